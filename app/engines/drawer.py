"""One renderer's images: a coarse one while something moves, ever finer ones at rest."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from app.engines.image import Image
from app.engines.messages import SupersededError
from app.engines.requests import UNWATCHED, ImageRequest, Watch
from app.engines.sizes import LONGEST_SECONDS, REST_SECONDS, SOON_SECONDS, Sizes
from model.rendering.raster import Raster
from model.rendering.renderer import Renderer
from model.scene.inputs import SceneInputs
from model.scene.scene import RENDERER_NAMES, RendererName

FIRST_GUESS_S = 5e-6
"""Expected time per pixel before the first image: that of VTK with gradient shading on a CPU."""

BAND_S, MOST_BANDS = 0.1, 32
"""Time that a band of a final image should take, and the largest number of bands.

A final image is given up between two bands.
"""

LIVE_COARSENESS = 4.0
"""Factor of the sample distance in VTK's images while something moves.

The ray caster's have all samples: in the same time fewer pixels are nearer to the image at rest
than fewer samples, and all pixels are that image.
"""


class Drawer:
    """Draws by one renderer, and measures how long that takes.

    Parameters
    ----------
    sample_distance : float
        Of VTK's images at rest, in voxels.
    name : str
        Which renderer it is, where it does not know itself.
    smooth : float, optional
        Sample distance of the ray caster's images; by default the same.
    is_brief : bool
        Whether no image may take long, as another renderer draws soon.
    sizes : Sizes, optional
        What is known of the times of its images.
    """

    def __init__(
        self,
        renderer: Renderer,
        sample_distance: float,
        name: RendererName = "raycast",
        smooth: float | None = None,
        is_brief: bool = False,
        sizes: Sizes | None = None,
    ) -> None:
        self.renderer = renderer
        self.sizes = sizes or Sizes()
        self.sample_distance, self._smooth = sample_distance, smooth or sample_distance
        self._name, self._is_brief = name, is_brief

    @property
    def description(self) -> str:
        """Name of the renderer; where another one had to draw, the sentence that says so."""
        name = RENDERER_NAMES["raycast" if self.by_raycast else self._name]
        return getattr(self.renderer, "reason", "") or name

    @property
    def remark(self) -> str:
        """One sentence on why this renderer draws; empty if it was asked for."""
        return getattr(self.renderer, "remark", "")

    @property
    def by_raycast(self) -> bool:
        """Whether the ray caster draws."""
        return getattr(self.renderer, "by_raycast", self._name == "raycast")

    @property
    def distance(self) -> float:
        """Distance between samples of images at rest, in voxels."""
        return self._smooth if self.by_raycast else self.sample_distance

    def is_slow(self, whole: Raster) -> bool:
        """Return whether something is to be seen before an image at rest."""
        return self.sizes.is_slow(self.distance, whole)

    def moving_raster(self, whole: Raster, seconds: float) -> Raster:
        """Return the pixels that there is time for while something moves."""
        return self.sizes.within(self._moving_distance, whole, seconds)

    def moving(self, inputs: SceneInputs, raster: Raster) -> Image:
        """Draw an image while something moves."""
        image = self._drawn(inputs, raster, self._moving_distance)
        return replace(image, stands_in=self._moving_distance != self.distance)

    def resting(
        self,
        request: ImageRequest,
        watch: Watch,
        width: int = 0,
        stand_in_limits: Sequence[float] = (),
    ) -> Iterator[Image]:
        """Draw ever finer images.

        Parameters
        ----------
        width : int
            That of the image which is shown; see :meth:`app.engines.sizes.Sizes.at_rest`.
        stand_in_limits : sequence of float
            Seconds that each may take where those of another renderer follow.
        """
        limits = stand_in_limits or limits_of(request, self._is_brief)
        whole = request.quality.pixels
        coming = self.sizes.at_rest(
            self.distance, whole, width, limits, must_end=not stand_in_limits
        )
        image, before = None, None
        for raster, is_last in coming:
            if image is not None and raster == before:
                yield replace(image, is_last=is_last)
                return
            before = raster
            expected = self.sizes.expected(self.distance, raster.side)
            seconds = expected or FIRST_GUESS_S * raster.columns * raster.rows
            bands = min(math.ceil(seconds / BAND_S), MOST_BANDS)
            image = self._drawn(request.inputs, raster, self.distance, bands, watch)
            yield replace(image, is_last=is_last)

    def _drawn(
        self,
        inputs: SceneInputs,
        raster: Raster,
        distance: float,
        bands: int = 1,
        watch: Watch = UNWATCHED,
    ) -> Image:
        """Draw a band of rows after the other."""
        begun = time.perf_counter()
        rgba = np.empty((*raster.shape, 4), dtype=np.float32)
        for band in raster.tiles(raster.columns, math.ceil(raster.rows / bands)):
            go_on_if(watch)
            rgba[band.top : band.bottom] = self.renderer.render(inputs, band, distance)
        seconds = time.perf_counter() - begun
        self.sizes.note(distance, raster.side, seconds)
        return Image(rgba, seconds, self.description, by_raycast=self.by_raycast)

    @property
    def _moving_distance(self) -> float:
        return self.distance * (1.0 if self.by_raycast else LIVE_COARSENESS)


def limits_of(request: ImageRequest, is_brief: bool = False) -> tuple[float, ...]:
    """Return the seconds that each of the images at rest may take."""
    if is_brief:
        return SOON_SECONDS, REST_SECONDS
    if request.is_fixed:
        return SOON_SECONDS, math.inf
    return SOON_SECONDS, REST_SECONDS, LONGEST_SECONDS


def go_on_if(watch: Callable[[], bool]) -> None:
    """Give up an answer that nobody waits for any more."""
    if not watch():
        raise SupersededError
