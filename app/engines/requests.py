"""Requests to engines and their images, as frozen data; and the interface of engines."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from app.engines.exactness import STOPS, USUAL, Exactness
from model.rendering.raster import Raster
from model.rendering.renderer import smooth_distance
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion
from model.scene.scene import LightDirection, Lighting, RendererName, Scene
from model.sensitivity.display import Measure

IMAGES = "images"  # channel of the images that an engine's pane shows
IMAGES_B = "images of B"  # channel of the images of pane B

Array = NDArray[np.float32]


class SupersededError(Exception):
    """Raised by an engine when an answer is no longer wanted."""


@dataclass(frozen=True)
class Watch:
    """Tells an engine whether its answer is still wanted, and takes its progress, 0 to 1."""

    is_wanted: Callable[[], bool] = lambda: True
    note: Callable[[float], object] = lambda _part: None
    gives_way: Callable[[], bool] = lambda: False  # whether an image at rest waits for other work

    def go_on(self) -> None:
        """Raise :class:`SupersededError` unless the answer is still wanted."""
        if not self.is_wanted():
            raise SupersededError

    def part(self, begun: float, share: float) -> Watch:
        """Return the watch of a part of the answer, which makes up a share of it."""
        return Watch(self.is_wanted, lambda part: self.note(begun + share * part))


UNWATCHED = Watch()  # for an answer that is always wanted


Drawing = Literal["auto"] | RendererName
"""A renderer of the reference image; "auto" is the one that suits machine and light."""


@dataclass(frozen=True)
class ReferenceSettings:
    """Settings of the reference renderer."""

    lighting: Lighting = "none"
    light: LightDirection | None = None
    sample_distance: float = 0.5  # of VTK's final images and of derivatives, in voxels
    renderer: Drawing = "vtk"  # "auto" for VTK at rest, and the ray caster in motion
    denoises: bool = True  # path-traced pictures, if the package for it is installed
    samples: int = 64  # of each pixel of path-traced pictures to save
    passes: bool = False
    """Whether another renderer draws soon, when its kernels are compiled. Until then every image is
    quick, and nothing replaces VTK."""
    is_truth: bool = False
    """Whether a generator's image is compared with it. Then VTK draws at rest for "auto" even
    without a graphics card; otherwise the ray caster would, which is several times as fast."""
    smooths: bool = False  # whether the ray caster alone draws, and voxels are blurred

    @property
    def smooth_distance(self) -> float:
        """Sample distance of the ray caster's final images, in voxels."""
        return smooth_distance(self.sample_distance, self.lighting)


@dataclass(frozen=True)
class Quality:
    """Size and quality of a requested image; a generator's images have one size."""

    size: int  # width and height in pixels, or the shorter of them
    live: bool = False  # during a drag, when speed matters more than quality
    raster: Raster | None = None  # pixels of an image that is not square
    samples: int = 1  # of each pixel of a path-traced picture to save

    @property
    def pixels(self) -> Raster:
        """Pixels of the image."""
        return self.raster or Raster(self.size, self.size)


@dataclass(frozen=True, eq=False)
class Image:
    """An image as far as it is drawn, or another array that answers a request."""

    rgba: Array  # (H, W, 4) in [0, 1], premultiplied, row 0 at the top
    seconds: float  # that it took
    by: str = ""  # description of the engine
    is_last: bool = True  # whether no better image of the same request follows
    by_raycast: bool = False
    is_preview: bool = False  # whether the image at rest has another renderer, or more samples
    samples: int = 1  # of each pixel in path-traced light
    error: float | None = None  # estimated RMS of the colours; infinite while it is not known
    quiet_seconds: float | None = None  # time that it would take with all cores to itself

    @property
    def width(self) -> int:
        """Pixels from left to right."""
        return int(self.rgba.shape[1])


@dataclass(frozen=True)
class Request:
    """Base class of requests to an engine."""

    asks: ClassVar[str]  # name of the engine's method that answers
    inputs: SceneInputs
    quality: Quality
    # Settings of the engine that answers; None for the engine that the client started.
    settings: ReferenceSettings | None = field(default=None, kw_only=True)
    # Not part of the question: a number that grows with every request, and the channel.
    sequence: int = field(default=0, compare=False, kw_only=True)
    channel: str = field(default=IMAGES, compare=False, kw_only=True)

    def answer(self, engine: Engine, watch: Watch) -> NDArray[Any] | Iterator[Image | None]:
        """Return an engine's answer, or an iterator of ever better images.

        Raises :class:`SupersededError` if the answer is no longer wanted.
        """
        return getattr(engine, self.asks)(self, watch)


@dataclass(frozen=True)
class ImageRequest(Request):
    """Request for a scene's images of growing quality, or for one while something moves."""

    asks = "images_of"
    stop: Exactness = STOPS[USUAL]
    is_fixed: bool = False  # whether all pixels are wanted, however long they take


@dataclass(frozen=True)
class TradeOffRequest(Request):
    """Request for seconds and error of images while something moves: float32 (n, 2).

    The n images have the :data:`app.engines.pace.SCALES` of the whole width, the smallest first.
    Their error is the distance from the last image at rest.
    """

    asks = "trade_off"


@dataclass(frozen=True)
class PictureRequest(Request):
    """Request for a picture to save, of any size: RGBA as uint8 (H, W, 4), premultiplied."""

    asks = "picture"


@dataclass(frozen=True)
class BatchRequest(Request):
    """Request for several images, float32 (N, H, W, 4), which may be of N latent codes."""

    asks = "images"
    more: tuple[SceneInputs, ...] = ()  # those of all images but the first, which has `inputs`
    codes: tuple[tuple[float, ...], ...] = ()  # empty to draw the TFs
    # Whether the images are path-traced if there is time, instead of a preview in another light.
    traced: bool = field(default=False, compare=False)


@dataclass(frozen=True)
class RegionSensitivityRequest(Request):
    """Request for a region's sensitivity to edits at each scalar value: float32 (256,).

    The width is the standard deviation of the edits, in bins of the TF.
    """

    asks = "region_sensitivity"
    region: ImageRegion
    width: float
    measure: Measure = "signed"


@dataclass(frozen=True)
class ValueSensitivityRequest(Request):
    """Request for each pixel's sensitivity to edits at some scalar values: float32 (H, W, 3)."""

    asks = "value_sensitivity"
    values: tuple[float, float]  # lowest and highest of the edit, in the data's units
    width: float  # standard deviation of the edit's flanks, in bins of the TF


@dataclass(frozen=True)
class ValueVisibilityRequest(Request):
    """Request for how much of each pixel shows some scalar values: float32 (H, W), 0 to 1."""

    asks = "value_visibility"
    values: tuple[float, float]
    width: float


@dataclass(frozen=True)
class VisibilityRequest(Request):
    """Request for the visibility of each scalar value in n regions: float32 (n, 256)."""

    asks = "visibility"
    regions: tuple[ImageRegion, ...]


class Engine(ABC):
    """Base class of engines; each is built, used and closed in one thread.

    A method returns the array that its request's class describes. It may raise
    :class:`SupersededError` when the answer is no longer wanted. Renderers have methods for the
    other requests, too.
    """

    scene: Scene | None = None  # what a generator was trained on
    image_error: float | None = None  # estimated error of the last saved picture; may be infinite

    @property
    def description(self) -> str:
        """Device and backend, for display; may be empty."""
        return ""

    @property
    def remark(self) -> str:
        """One sentence on why this engine draws instead of another; empty if the user chose it."""
        return ""

    @abstractmethod
    def images_of(self, request: ImageRequest, watch: Watch = UNWATCHED) -> Iterator[Image | None]:
        """Draw ever better images, up to the final one; stop when they are no longer wanted.

        None is yielded to let other work come first.
        """

    @abstractmethod
    def picture(self, request: PictureRequest, watch: Watch = UNWATCHED) -> NDArray[np.uint8]:
        """Draw a picture to save."""

    @abstractmethod
    def images(self, request: BatchRequest, watch: Watch = UNWATCHED) -> Array:
        """Draw several images."""

    @abstractmethod
    def region_sensitivity(
        self, request: RegionSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Differentiate the image by each scalar value; not offered by VTK."""

    @abstractmethod
    def value_sensitivity(
        self, request: ValueSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Differentiate each pixel by some scalar values; not offered by VTK."""

    def forget(self, channel: str) -> None:  # noqa: B027, most keep nothing
        """Free the data of a channel's images, which are hidden."""

    def close(self) -> None:  # noqa: B027, many have nothing to release
        """Release the engine's resources."""
