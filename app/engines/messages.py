"""Messages between the window and its engines' threads, as plain, frozen data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion
from model.scene.scene import Scene
from model.sensitivity.measure import Measure

GOOD_ENOUGH = 0.003
"""Error of an image, root mean square of its colours, that no eye sees: less than an 8-bit step."""


@dataclass(frozen=True)
class Quality:
    """Quality of a requested image; generators have a fixed size and ignore the coarseness.

    Attributes
    ----------
    size : int
        Width and height in pixels; of a picture that is not square, the shorter of the two.
    coarseness : float
        Factor of a renderer's sample distance.
    live : bool
        True while the user is dragging and speed matters more than quality.
    raster : Raster or None
        Pixels of a picture that is not square; None for a square one.
    samples : int
        Of each pixel in path-traced light; other renderers ignore it.
    error : float
        Estimated error from which a path-traced image gets no more samples.
    """

    size: int
    coarseness: float = 1.0
    live: bool = False
    raster: Raster | None = None
    samples: int = 1
    error: float = GOOD_ENOUGH

    @property
    def pixels(self) -> Raster:
        """Pixels of the picture."""
        return self.raster or Raster(self.size, self.size)


@dataclass(frozen=True)
class Request:
    """Base class of requests to an engine; each subclass is a kind of request.

    Attributes
    ----------
    sequence : int
        Number that increases with every request.
    inputs : SceneInputs
    quality : Quality
    """

    sequence: int
    inputs: SceneInputs
    quality: Quality


@dataclass(frozen=True)
class ImageRequest(Request):
    """Request for one image: float32 RGBA (H, W, 4) in [0, 1], premultiplied, row 0 at the top."""


@dataclass(frozen=True)
class StandInRequest(Request):
    """Request to the ray caster for the image that stands in for the reference's until then."""


@dataclass(frozen=True)
class TradeRequest(Request):
    """Request for an image as while something moves, of which only time and error are wanted."""


@dataclass(frozen=True)
class PictureRequest(Request):
    """Request for a picture to save, of any size: RGBA as uint8 (H, W, 4), premultiplied."""


@dataclass(frozen=True)
class MovieFrameRequest(PictureRequest):
    """Request for the next picture of a movie."""


@dataclass(frozen=True)
class BatchRequest(Request):
    """Request for several images, float32 (N, S, S, 4).

    Attributes
    ----------
    more : tuple of SceneInputs
        Those of all images but the first, which has `inputs`.
    codes : tuple of tuple of float
        N latent codes of a generator that draws them, in place of the opacity TFs of the N
        inputs; all else in these is the same. Empty to draw the TFs.
    """

    more: tuple[SceneInputs, ...] = ()
    codes: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class MeasureRequest(BatchRequest):
    """Request for images by which edits are measured."""


@dataclass(frozen=True)
class GridRequest(BatchRequest):
    """Request for the images of a brushed rectangle's cells."""


@dataclass(frozen=True)
class HoverRequest(BatchRequest):
    """Request for the image of the place under the mouse on the map."""


@dataclass(frozen=True)
class ThumbnailRequest(BatchRequest):
    """Request for small images of some samples of the map."""


@dataclass(frozen=True)
class SearchRequest(BatchRequest):
    """Request for images that a search for a goal compares."""


@dataclass(frozen=True)
class FrameRequest(BatchRequest):
    """Request for the next image of a path between places."""


@dataclass(frozen=True)
class UpAxisRequest(BatchRequest):
    """Request for images of a volume with each of its axes up."""


@dataclass(frozen=True)
class PresetRequest(BatchRequest):
    """Request for images of a volume under each preset."""


@dataclass(frozen=True)
class ErrorRequest(BatchRequest):
    """Request for images by which a model is compared with the ray caster."""


@dataclass(frozen=True)
class RegionSensitivityRequest(Request):
    """Request for a region's sensitivity to edits at each scalar value: float32 (256,).

    Attributes
    ----------
    region : ImageRegion
    width : float
        Standard deviation of the edits, in bins of the TF.
    measure : {"change", "signed"}
    """

    region: ImageRegion
    width: float
    measure: Measure = "signed"


@dataclass(frozen=True)
class ValueSensitivityRequest(Request):
    """Request for each pixel's sensitivity to edits at some scalar values: float32 (S, S, 3).

    Attributes
    ----------
    values : tuple of float
        Lowest and highest scalar value of the edit, in the data's units.
    width : float
        Standard deviation of the edit's flanks, in bins of the TF.
    """

    values: tuple[float, float]
    width: float


@dataclass(frozen=True)
class BlockFieldsRequest(Request):
    """Request for the sensitivity of blocks to edits at all scalar values: float32 (n, n, 256).

    Attributes
    ----------
    blocks : int
        Number of blocks along either side of the square image; 0 for one a pixel.
    width : float
        Standard deviation of the edits, in bins of the TF.
    """

    blocks: int
    width: float


@dataclass(frozen=True)
class FieldRangeRequest(Request):
    """Request for the ends of the scale over the fields of many scalar values: float32 (2,).

    They are those by the measures "change" and "signed", see
    :func:`model.sensitivity.block_fields.largest_scales`.

    Attributes
    ----------
    window : tuple of float
        Lowest and highest of these values, in the data's units.
    width : float
        Standard deviation of the edits, in bins of the TF.
    """

    window: tuple[float, float]
    width: float


@dataclass(frozen=True)
class ValueVisibilityRequest(Request):
    """Request for how much of each pixel shows some scalar values: float32 (H, W), 0 to 1.

    Attributes
    ----------
    values : tuple of float
        Lowest and highest of them, in the data's units.
    width : float
        Standard deviation of the flanks beyond these, in bins of the TF.
    """

    values: tuple[float, float]
    width: float


@dataclass(frozen=True)
class VisibilityRequest(Request):
    """Request for the visibility of each scalar value in n regions: float32 (n, 256)."""

    regions: tuple[ImageRegion, ...]


@dataclass(frozen=True)
class PickRequest(VisibilityRequest):
    """Request for the visibility of each scalar value at a place that was clicked."""


@dataclass(frozen=True)
class DecodedTFRequest(Request):
    """Request for what a generator's codec makes of the opacity TF: opacities, float32 (256,)."""


@dataclass(frozen=True, eq=False)
class Result:
    """Result of a request: an array or an error, never both.

    Attributes
    ----------
    request : Request
    value : ndarray of float32, or None
        Array of the shape given by the request's class.
    error : str or None
        One sentence for the user.
    seconds : float
        Computation time.
    description, remark : str
        The engine's, which may change as it falls back on another renderer; "" for as before.
    by_raycast : bool
        Whether the ray caster has drawn it.
    image_error : float or None
        How far the engine estimates an image from the exact one, root mean square of the
        colours, infinite as long as it does not know; None if it does not estimate it.
    """

    request: Request
    value: NDArray[np.float32] | None
    error: str | None
    seconds: float
    description: str = ""
    remark: str = ""
    by_raycast: bool = False
    image_error: float | None = None


class SupersededError(Exception):
    """Raised by an engine that gives up an answer nobody waits for any more."""


@dataclass(frozen=True)
class EngineReady:
    """Message that an engine is built and accepts requests.

    Attributes
    ----------
    description : str
        Device and backend, for display; may be empty.
    scene : Scene or None
        Scene that a generator was trained on; None for renderers.
    draws_codes : bool
        Whether it draws images from latent codes.
    remark : str
        One sentence on why this one draws, and no other; may be empty.
    by_raycast : bool
        Whether the ray caster draws.
    """

    description: str
    scene: Scene | None
    draws_codes: bool = False
    remark: str = ""
    by_raycast: bool = False


@dataclass(frozen=True)
class EngineFailed:
    """Message that an engine could not be built; `error` is one sentence for the user."""

    error: str


Message = EngineReady | EngineFailed | Result | None
"""Message from a worker's thread; None when the thread has ended."""


def error_sentence(error: BaseException) -> str:
    """Return an exception's message for the user.

    tfscope's own errors are complete sentences. Other exceptions are defects, and
    their type is included.
    """
    if isinstance(error, TfscopeError):
        return str(error)
    return f"Unexpected {type(error).__name__}: {error}"


def kind_of(request: Any) -> str:
    """Name of a request's kind for display, such as "image" or "region sensitivity"."""
    words = type(request).__name__.removesuffix("Request")
    return "".join(f" {c.lower()}" if c.isupper() else c for c in words).strip()
