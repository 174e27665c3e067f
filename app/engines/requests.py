"""The interface of engines: what they are asked, as frozen data, and the methods that answer it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from app.engines.exactness import STOPS, USUAL, Exactness
from app.engines.image import Image
from app.engines.quality import Quality
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion
from model.scene.scene import Scene
from model.sensitivity.display import Measure

IMAGES = "images"
"""Name of the channel whose images an engine's pane shows."""

Array = NDArray[np.float32]


class Watch:
    """Says whether an engine's answer is still wanted, and takes how far it has got.

    Parameters
    ----------
    noted : callable
        Is given the part of the answer that is there, 0 to 1.
    """

    def __init__(
        self,
        is_wanted: Callable[[], bool] = lambda: True,
        noted: Callable[[float], None] = lambda _part: None,
    ) -> None:
        self._is_wanted, self._noted = is_wanted, noted

    def __call__(self) -> bool:
        """Whether somebody still waits for the answer; from any thread."""
        return self._is_wanted()

    def note(self, part: float) -> None:
        """Note how much of the answer is there, 0 to 1, where that is known."""
        self._noted(part)


UNWATCHED = Watch()
"""For an answer that is wanted to the end."""


@dataclass(frozen=True)
class Request(ABC):
    """Base class of requests to an engine.

    Attributes
    ----------
    sequence : int
        Number that increases with every request, of any engine; no part of the question.
    channel : str
        Name of the channel on which it was asked; no part of the question.
    """

    inputs: SceneInputs
    quality: Quality
    sequence: int = field(default=0, compare=False, kw_only=True)
    channel: str = field(default=IMAGES, compare=False, kw_only=True)

    @abstractmethod
    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any] | Iterator[Image]:
        """Return an engine's answer, or ever better ones.

        Raises
        ------
        NotOfferedError
            If the engine does not answer such requests.
        SupersededError
            When the engine has given up, as nobody waits for the answer.
        """


@dataclass(frozen=True)
class ImageRequest(Request):
    """Request for ever better images of a scene; of one only while something moves.

    The pixels of its quality are those of the whole image, of which coarser ones have fewer.

    Attributes
    ----------
    stop : Exactness
        What images may take while something moves, and owe at rest.
    is_fixed : bool
        Whether all pixels are wanted, however long they take.
    """

    stop: Exactness = STOPS[USUAL]
    is_fixed: bool = False

    def answer(self, engine: Engine, watch: Watch) -> Iterator[Image]:
        """Draw them."""
        return engine.images_of(self, watch)


@dataclass(frozen=True)
class TradeRequest(Request):
    """Request for seconds and error of images while something moves: float32 (n, 2).

    The n images have each of :data:`app.engines.pace.SCALES` of the whole width, the fewest pixels
    first. Their error is the distance from the last image at rest.
    """

    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any]:
        """Draw and measure them."""
        return engine.trade(self, watch)


@dataclass(frozen=True)
class PictureRequest(Request):
    """Request for a picture to save, of any size: RGBA as uint8 (H, W, 4), premultiplied."""

    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any]:
        """Draw it."""
        return engine.picture(self, watch)


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
    traced : bool
        Whether path-traced light is wanted where it is that of the volume, and there is time; else
        another one draws a preview. No part of the question.
    """

    more: tuple[SceneInputs, ...] = ()
    codes: tuple[tuple[float, ...], ...] = ()
    traced: bool = field(default=False, compare=False)

    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any]:
        """Draw them."""
        if self.codes:
            return engine.latent_images(self)
        return engine.images(self, watch)


@dataclass(frozen=True)
class RegionSensitivityRequest(Request):
    """Request for a region's sensitivity to edits at each scalar value: float32 (256,).

    Attributes
    ----------
    width : float
        Standard deviation of the edits, in bins of the TF.
    measure : {"change", "signed"}
    """

    region: ImageRegion
    width: float
    measure: Measure = "signed"

    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any]:
        """Differentiate the image."""
        return engine.region_sensitivity(self, watch)


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

    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any]:
        """Differentiate the image."""
        return engine.value_sensitivity(self, watch)


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

    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any]:
        """Look along the rays."""
        return engine.value_visibility(self)


@dataclass(frozen=True)
class VisibilityRequest(Request):
    """Request for the visibility of each scalar value in n regions: float32 (n, 256)."""

    regions: tuple[ImageRegion, ...]

    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any]:
        """Look along the rays."""
        return engine.visibility(self)


class Engine(Protocol):
    """Interface of engines; each is built, used and closed in one thread.

    Each method returns the array described by its request's class, and raises
    :class:`model.errors.NotOfferedError` if the engine does not support the request. One that
    asks whether its answer is wanted may raise :class:`SupersededError` once it is not.
    """

    @property
    def description(self) -> str:
        """Device and backend, for display; may be empty."""

    @property
    def remark(self) -> str:
        """One sentence on why this one draws, and no other; empty if nothing is to be said."""

    @property
    def image_error(self) -> float | None:
        """Estimated RMSE of the last picture to save, infinite if not known; None without one."""

    @property
    def scene(self) -> Scene | None:
        """Scene that a generator was trained on; None for renderers."""

    @property
    def draws_codes(self) -> bool:
        """Whether images can be drawn from latent codes; False for renderers."""

    def images_of(self, request: ImageRequest, watch: Watch = UNWATCHED) -> Iterator[Image]:
        """Draw ever better images, up to one that is the last; fewer once none is wanted."""

    def trade(self, request: TradeRequest, watch: Watch = UNWATCHED) -> Array:
        """Measure time and error of images while something moves."""

    def picture(self, request: PictureRequest, watch: Watch = UNWATCHED) -> NDArray[np.uint8]:
        """Draw a picture to save."""

    def images(self, request: BatchRequest, watch: Watch = UNWATCHED) -> Array:
        """Draw several images."""

    def region_sensitivity(
        self, request: RegionSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Compute the sensitivity of a region to edits at each scalar value."""

    def value_sensitivity(
        self, request: ValueSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Compute the sensitivity of each pixel to edits at one scalar value."""

    def visibility(self, request: VisibilityRequest) -> Array:
        """Compute the visibility of each scalar value in a region."""

    def value_visibility(self, request: ValueVisibilityRequest) -> Array:
        """Compute how much of each pixel shows some scalar values."""

    def latent_images(self, request: BatchRequest) -> Array:
        """Draw images from the request's latent codes."""

    def close(self) -> None:
        """Release the engine's resources."""
