"""The path tracer as an engine, whose picture goes on where the last request for it ended."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from app.engines.messages import SupersededError
from app.engines.renderer_engine import TILE, RendererEngine
from app.engines.requests import UNWATCHED, Array, ImageRequest, PictureRequest, Watch
from model.rendering.path_tracing.coarse_light import SIDE
from model.rendering.path_tracing.refinement import MOST_SAMPLES, Refined, RefiningRenderer
from model.rendering.path_tracing.renderer import questions
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

FEW_CLEAN, FEW = 1, 16
"""Samples of each pixel of small pictures, where they are cleaned and where they are not."""

MARGIN = 64
"""Pixels around a tile of a picture to save."""


class PathTracingEngine(RendererEngine):
    """The path tracer as an engine, which counts an image's samples, and estimates its error.

    Parameters
    ----------
    renderer : RefiningRenderer
        Draws pictures to save with as many samples as it has.
    sample_distance : float
        Of final images, in voxels.
    release : callable
        Releases what cleans.
    """

    by_raycast = False

    def __init__(
        self,
        renderer: RefiningRenderer,
        sample_distance: float,
        release: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__(renderer, sample_distance)
        self._refining, self._release = renderer, release
        self._said = ""
        self._drawn = _Drawn()

    @property
    def description(self) -> str:
        """Name of the renderer, and what it says of its last image."""
        return f"path tracer{self._said}"

    def image(self, request: ImageRequest, watch: Watch = UNWATCHED) -> Array:
        """Trace as many samples as the request asks for, until it is no longer wanted.

        A request for more samples of the last picture goes on where that ended. While something
        moves, several pixels share their light.
        """
        quality = request.quality
        distance = self._sample_distance * quality.coarseness
        if quality.live:
            return self._moving(request, distance, watch)
        key = request.inputs, quality.pixels, distance
        # What is measured is drawn anew, even if it is there.
        if self._drawn.key != key or request.is_measured:
            self._drawn = drawn = _Drawn(key)
            drawn.coming = self._refining.refined(
                request.inputs,
                quality.pixels,
                MOST_SAMPLES,
                lambda: drawn.watch(),
                distance,
            )
        last = self._drawn.after(quality.samples, quality.error, watch)
        if last is None:
            self._drawn = _Drawn()
            raise SupersededError
        self._said = f", {last.samples} sample{'s' * (last.samples > 1)}"
        if last.deed:
            self._said += f", {last.deed}"
        self.image_error = last.error
        return last.rgba

    def _moving(self, request: ImageRequest, distance: float, watch: Watch) -> Array:
        renderer = self._refining
        picture = renderer.moving(request.inputs, request.quality.pixels, watch, distance)
        if picture is None:
            raise SupersededError
        self._said = ""
        if picture.deed:
            self._said = f", light of 1 in {SIDE**2} pixels, {picture.deed}"
        self.image_error = picture.error
        return picture.rgba

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
        whole, distance = quality.pixels, self._sample_distance * quality.coarseness
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
        """End the tracer, and release what cleans."""
        super().close()
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


class _Drawn:
    """A path-traced picture that becomes better, as far as it is drawn."""

    def __init__(self, key: object = None) -> None:
        self.key = key
        self.coming: Iterator[Refined] = iter(())
        self.watch: Watch = UNWATCHED
        self._last: Refined | None = None

    def after(self, samples: int, error: float, watch: Watch) -> Refined | None:
        """Return it after some samples, or with fewer if it is good enough; None if unwanted."""
        self.watch = watch
        while self._last is None or (self._last.samples < samples and self._last.error > error):
            picture = next(self.coming, None)
            if picture is None:
                return self._last if watch() else None
            self._last = picture
        return self._last
