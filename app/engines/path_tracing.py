"""The path tracer as an engine, whose images have ever more samples."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.engines.drawer import Drawer, limits_of
from app.engines.image import Image
from app.engines.messages import SupersededError
from app.engines.renderer_engine import TILE, RendererEngine
from app.engines.requests import UNWATCHED, Array, ImageRequest, PictureRequest, Request, Watch
from app.engines.sizes import FINER, FIRST_SLOW_SCALE, SOON_SECONDS, Sizes
from model.rendering.path_tracing.coarse_light import SIDE
from model.rendering.path_tracing.refinement import MOST_SAMPLES, Refined, RefiningRenderer
from model.rendering.path_tracing.renderer import questions
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

MOVING, SAMPLE = "moving", "one sample of each pixel"
"""Kinds of images, whose times are measured."""

FEW_CLEAN, FEW = 1, 16
"""Samples of each pixel of small pictures, where they are cleaned and where they are not."""

MARGIN = 64
"""Pixels around a tile of a picture to save."""


class PathTracingEngine(RendererEngine):
    """The path tracer as an engine, which counts an image's samples, and estimates its error.

    While something moves, several pixels share their light. Where nothing cleans, the ray caster
    draws then, in soft light.

    Parameters
    ----------
    renderer : RefiningRenderer
        Draws pictures to save with as many samples as it has.
    sample_distance : float
        Of final images, in voxels.
    release : callable
        Releases what cleans.
    open_soft : callable, optional
        Opens the ray caster in soft light; None to do without.
    """

    def __init__(
        self,
        renderer: RefiningRenderer,
        sample_distance: float,
        release: Callable[[], None] = lambda: None,
        open_soft: Callable[[], Drawer] | None = None,
    ) -> None:
        super().__init__(Drawer(renderer, sample_distance))
        self._refining, self._distance = renderer, sample_distance
        self._release, self._open_soft = release, open_soft
        self._soft: Drawer | None = None
        self._sizes = Sizes(FIRST_SLOW_SCALE)
        self._said = ""
        # What is traced, how it goes on and how far it has got.
        self._traced: tuple[SceneInputs, Raster] | None = None
        self._coming: Iterator[Refined] = iter(())
        self._last: Refined | None = None
        self._seconds = 0.0
        self._watch = UNWATCHED

    @property
    def description(self) -> str:
        """Name of the renderer, and what it says of its last image."""
        return f"path tracer{self._said}"

    def _moving_raster(self, whole: Raster, seconds: float) -> Raster:
        if self._stand_in is not None:
            return self._stand_in.moving_raster(whole, seconds)
        return self._sizes.within(MOVING, whole, seconds)

    def _moving(self, request: Request, raster: Raster, watch: Watch = UNWATCHED) -> Image:
        if self._stand_in is not None:
            return replace(self._stand_in.moving(request.inputs, raster), stands_in=True)
        begun = time.perf_counter()
        found = self._refining.moving(request.inputs, raster, watch, self._distance)
        if found is None:
            raise SupersededError
        self._seconds = time.perf_counter() - begun
        self._sizes.note(MOVING, raster.side, self._seconds)
        said = f", light of 1 in {SIDE**2} pixels, {found.deed}" if found.deed else ""
        return self._image(found, said)

    def _resting(self, request: ImageRequest, watch: Watch, width: int) -> Iterator[Image]:
        """Trace more and more samples of each pixel, on from where the same scene's image ended.

        Where one sample takes long, coarser images come first.
        """
        inputs, whole = request.inputs, request.quality.pixels
        if self._last is not None and self._traced is not None and self._traced[0] == inputs:
            width = max(width, self._last.rgba.shape[1])
        if width < whole.width and self._sizes.is_slow(SAMPLE, whole):
            for image in self._first(request, watch, width):
                yield replace(image, is_last=False)
                width = image.width
        limits = limits_of(request)[1:]
        for raster, is_last in self._sizes.at_rest(SAMPLE, whole, width, limits):
            yield from self._refined(request, raster, is_last, watch)

    def _first(self, request: ImageRequest, watch: Watch, width: int) -> Iterator[Image]:
        """Draw what is seen before the first sample of each pixel."""
        whole = request.quality.pixels
        if self._stand_in is not None:
            for image in self._stand_in.resting(request, watch, width, (SOON_SECONDS,)):
                yield replace(image, stands_in=True)
            return
        raster = self._sizes.within(MOVING, whole, SOON_SECONDS)
        if raster.width > FINER * width:
            yield self._moving(request, raster, watch)

    def _refined(
        self, request: ImageRequest, raster: Raster, is_last: bool, watch: Watch
    ) -> Iterator[Image]:
        """Draw an image with ever more samples, or with one, if a finer image follows."""
        self._watch = watch
        if self._traced != (request.inputs, raster):
            self._traced, self._last = (request.inputs, raster), None
            self._coming = self._refining.refined(
                request.inputs, raster, MOST_SAMPLES, lambda: self._watch(), self._distance
            )
        found, stop = self._last or self._go_on(raster), request.stop
        while True:
            said = f", {found.samples} sample{'s' * (found.samples > 1)}"
            said += f", {found.deed}" if found.deed else ""
            is_enough = found.samples >= stop.samples or found.error <= stop.error
            yield replace(self._image(found, said), is_last=is_last and is_enough)
            if is_enough or not is_last:
                return
            found = self._go_on(raster)

    def _go_on(self, raster: Raster) -> Refined:
        """Trace more samples."""
        begun = time.perf_counter()
        self._last = next(self._coming, None)
        if self._last is None:
            # It has ended, as nobody wants it.
            self._traced = None
            raise SupersededError
        self._seconds = time.perf_counter() - begun
        if self._last.samples == 1:
            self._sizes.note(SAMPLE, raster.side, self._seconds)
        return self._last

    def _image(self, found: Refined, said: str) -> Image:
        self._said = said
        samples, error = found.samples, found.error
        return Image(found.rgba, self._seconds, self.description, samples=samples, error=error)

    @property
    def _stand_in(self) -> Drawer | None:
        """The ray caster in soft light, where it draws what moves."""
        if self._soft is None and self._open_soft is not None and not self._refining.cleans:
            self._soft = self._open_soft()
        return self._soft

    def _small(self, inputs: SceneInputs, pixels: Raster, distance: float, watch: Watch) -> Array:
        """Trace a small image of few samples."""
        renderer = self._refining
        samples = FEW_CLEAN if renderer.cleans else FEW
        drawn = renderer.drawn(inputs, pixels, samples, watch, distance)
        if drawn is None:
            raise SupersededError
        return drawn.rgba

    def picture(self, request: PictureRequest, watch: Watch = UNWATCHED) -> NDArray[np.uint8]:
        """Trace a picture of any size, tile by tile, with the samples that the request asks for.

        Tiles are drawn with a margin: what takes the noise out looks around each pixel.
        """
        quality, renderer = request.quality, self._refining
        whole, distance = quality.pixels, self._distance
        samples = quality.samples if quality.samples > 1 else renderer.samples
        picture = np.empty((whole.height, whole.width, 4), dtype=np.uint8)
        squares = 0.0
        tiles = list(whole.tiles(TILE, TILE))
        for number, tile in enumerate(tiles):
            wide = tile.grown(MARGIN)
            counting = _Counting(watch, number / len(tiles), 1 / len(tiles), wide, samples)
            drawn = renderer.drawn(request.inputs, wide, samples, counting, distance)
            if drawn is None:
                raise SupersededError
            top, left = tile.top - wide.top, tile.left - wide.left
            image = drawn.rgba[top : top + tile.rows, left : left + tile.columns]
            part = picture[tile.top : tile.bottom, tile.left : tile.right]
            part[...] = np.rint(255 * image)
            squares += drawn.error**2 * tile.rows * tile.columns
        self.image_error = math.sqrt(squares / (whole.height * whole.width))
        return picture

    def close(self) -> None:
        """End the tracer and the ray caster, and release what cleans."""
        super().close()
        if self._soft is not None:
            self._soft.renderer.close()
        self._release()


class _Counting:
    """Notes how far a tile has got by how often it was asked whether that is wanted."""

    def __init__(
        self, watch: Watch, begun: float, share: float, tile: Raster, samples: int
    ) -> None:
        self._watch, self._begun = watch, begun
        self._part = share / questions(tile, samples)
        self._asked = 0

    def __call__(self) -> bool:
        self._asked += 1
        self._watch.note(self._begun + self._asked * self._part)
        return self._watch()
