"""Path-traced light: the path tracer as an engine, and the analyst under that light."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import count

from app.engines.drawer import Drawer, limits_of
from app.engines.pace import FINER, FIRST_SLOW_SCALE, SOON_SECONDS, Sizes
from app.engines.renderer_engine import RendererEngine
from app.engines.requests import (
    UNWATCHED,
    Array,
    BatchRequest,
    Engine,
    Image,
    ImageRequest,
    PictureRequest,
    Request,
    SupersededError,
    Watch,
)
from model.rendering.path_tracing.moving_light import SIDE
from model.rendering.path_tracing.refinement import MOST_SAMPLES, Refined, RefiningRenderer
from model.rendering.path_tracing.renderer import questions
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import smooth_distance
from model.scene.inputs import SceneInputs
from model.scene.scene import PATH_CURVES, PATH_FIELDS, LightDirection
from model.scene.volume import Volume

MOVING, SAMPLE = "moving", "one sample of each pixel"  # kinds of images, whose times are measured
LEAST_SAMPLES = 8  # fewest per pixel at rest, even on the slowest machine
FIRST_SHARE = 1 / 6  # share of the first sample's time that a finer unlit image before it may take
FEW_CLEAN, FEW = 1, 16  # samples per pixel of small pictures, with and without denoising
MARGIN = 64  # pixels around a tile of a saved picture that the denoiser also sees
FIRST_GUESS_S = 5e-6  # assumed time per traced pixel before the first one, on two cores
TRACED_SECONDS = 2.0  # longest time for which several small pictures are traced
FORGOTTEN = 0.8  # factor of the expected time, each time it was too long


@dataclass
class _Tracing:
    """Tracing of one pane's image: its scene, the running refinement, and the last image."""

    inputs: SceneInputs
    raster: Raster
    coming: Iterator[Refined | None] = field(default_factory=lambda: iter(()))
    last: Refined | None = None
    spent: float = 0.0  # seconds until the last image
    taken: float = 0.0  # seconds since then
    watch: Watch = UNWATCHED

    def is_wanted(self) -> bool:
        """Whether to go on: tracing pauses for other work, and for good if it is superseded."""
        return self.watch.is_wanted() and not self.watch.gives_way()


class PathTracingEngine(RendererEngine):
    """The path tracer as an engine: images get more and more samples, and an estimated error.

    While something moves, several pixels share their light; without a denoiser the ray caster draws
    soft light instead, if it may. `release` releases the denoiser.
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
        self._details = ""
        self._traced: dict[str, _Tracing] = {}  # by the channel
        self._seconds = 0.0

    @property
    def description(self) -> str:
        """Name of the renderer, with the details of its last image."""
        return f"path tracer{self._details}"

    def _moving_raster(self, whole: Raster, seconds: float) -> Raster:
        if self._preview is not None:
            return self._preview.moving_raster(whole, seconds)
        return self._sizes.within(MOVING, whole, seconds)

    def _moving(self, request: Request, raster: Raster, watch: Watch = UNWATCHED) -> Image:
        if self._preview is not None:
            return replace(self._preview.moving(request.inputs, raster, watch), is_preview=True)
        begun = time.perf_counter()
        found = self._refining.moving(request.inputs, raster, watch.is_wanted, self._distance)
        if found is None:
            raise SupersededError
        self._seconds = time.perf_counter() - begun
        self._sizes.note(MOVING, raster.side, self._seconds)
        details = f", light of 1 in {SIDE**2} pixels, {found.method}" if found.method else ""
        return self._image(found, details)

    def _resting(self, request: ImageRequest, watch: Watch, width: int) -> Iterator[Image | None]:
        """Trace more and more samples per pixel; an image of the same scene is continued."""
        whole, traced = request.quality.pixels, self._traced.get(request.channel)
        if traced is not None and traced.last is not None and traced.inputs == request.inputs:
            width = max(width, traced.last.rgba.shape[1])
        if width < whole.width and self._sizes.is_slow(SAMPLE, whole, SOON_SECONDS):
            for image in self._first(request, watch, width):
                yield replace(image, is_last=False)
                width = image.width
        limits = limits_of(request)[1:]
        for raster, is_last in self._sizes.at_rest(SAMPLE, whole, width, limits):
            yield from self._refined(request, raster, is_last, watch)

    def _first(self, request: ImageRequest, watch: Watch, width: int) -> Iterator[Image]:
        """Draw the image that is shown before the first sample per pixel."""
        whole = request.quality.pixels
        if self._preview is not None:
            for image in self._preview.resting(request, watch, width, (SOON_SECONDS,)):
                yield replace(image, is_preview=True)
            return
        # If the first sample takes long, a finer unlit image replaces that of the drag.
        seconds = (self._sizes.expected(SAMPLE, whole.side) or 0.0) * FIRST_SHARE
        raster = self._sizes.within(MOVING, whole, max(seconds, SOON_SECONDS))
        if raster.width > FINER * width:
            yield self._moving(request, raster, watch)

    def _refined(
        self, request: ImageRequest, raster: Raster, is_last: bool, watch: Watch
    ) -> Iterator[Image | None]:
        """Draw an image with more and more samples, or with one if a finer image follows."""
        traced, scene = self._traced.get(request.channel), (request.inputs, raster)
        if traced is None or (traced.inputs, traced.raster) != scene:
            traced = self._traced[request.channel] = _Tracing(*scene)
            traced.coming = self._refining.refined(
                *scene, MOST_SAMPLES, traced.is_wanted, self._distance
            )
        traced.watch = watch
        found, stop = traced.last, request.stop
        while True:
            while found is None:
                found = self._go_on(request.channel, traced)
                if found is None:
                    watch.go_on()
                    yield None
            details = f", {found.samples} sample{'s' * (found.samples > 1)}"
            details += f", {found.method}" if found.method else ""
            is_enough = found.samples >= stop.samples or found.error <= stop.error
            # The next one has twice the samples.
            is_late = 2 * traced.spent > stop.refining_seconds
            is_enough = is_enough or (is_late and found.samples >= LEAST_SAMPLES)
            yield replace(self._image(found, details), is_last=is_last and is_enough)
            if is_enough or not is_last:
                return
            found = None

    def _go_on(self, channel: str, traced: _Tracing) -> Refined | None:
        """Trace more samples; None if others come first."""
        begun = time.perf_counter()
        # What an error ends begins anew.
        self._traced.pop(channel, None)
        found = next(traced.coming)
        self._traced[channel] = traced
        traced.taken += time.perf_counter() - begun
        if found is not None:
            self._seconds, traced.taken, traced.last = traced.taken, 0.0, found
            traced.spent += self._seconds
            if found.samples == 1:
                self._sizes.note(SAMPLE, traced.raster.side, self._seconds)
        return found

    def _image(self, found: Refined, details: str) -> Image:
        self._details = details
        samples, error = found.samples, found.error
        return Image(found.rgba, self._seconds, self.description, samples=samples, error=error)

    @property
    def _preview(self) -> Drawer | None:
        """The ray caster in soft light, where it draws what moves."""
        if self._soft is None and self._open_soft is not None and not self._refining.cleans:
            self._soft = self._open_soft()
        return self._soft

    def _small(self, request: BatchRequest, inputs: SceneInputs, watch: Watch) -> Array:
        """Trace a small image of few samples."""
        samples, pixels = FEW_CLEAN if self._refining.cleans else FEW, request.quality.pixels
        return self._whole(inputs, pixels, samples, watch.is_wanted).rgba

    def _tile(
        self, request: PictureRequest, tile: Raster, watch: Watch
    ) -> tuple[Array, float | None]:
        """Trace a tile with the requested number of samples, or the usual number."""
        quality, wide, asked = request.quality, tile.grown(MARGIN), count(1)
        samples = quality.samples if quality.samples > 1 else self._refining.samples
        share = 1 / questions(wide, samples)

        def is_wanted() -> bool:
            watch.note(next(asked) * share)
            return watch.is_wanted()

        drawn = self._whole(request.inputs, wide, samples, is_wanted)
        top, left = tile.top - wide.top, tile.left - wide.left
        return drawn.rgba[top : top + tile.rows, left : left + tile.columns], drawn.error

    def _whole(
        self, inputs: SceneInputs, raster: Raster, samples: int, is_wanted: Callable[[], bool]
    ) -> Refined:
        drawn = self._refining.drawn(inputs, raster, samples, is_wanted, self._distance)
        if drawn is None:
            raise SupersededError
        return drawn

    def forget(self, channel: str) -> None:
        """Free what is traced."""
        super().forget(channel)
        self._traced.pop(channel, None)

    def close(self) -> None:
        """End the tracer and the ray caster, and release the denoiser."""
        super().close()
        if self._soft is not None:
            self._soft.renderer.close()
        self._release()


class PathAnalyst(RendererEngine):
    """The analyst under path-traced light: it answers for lights that are close to it.

    Fields of values are in soft light, curves of regions unlit. `tracing` builds the tracer of
    small pictures, which are traced if there is time.
    """

    _curves: RaycastRenderer

    def __init__(
        self,
        volume: Volume,
        light: LightDirection | None,
        sample_distance: float,
        tracing: Callable[[], Engine] | None = None,
    ) -> None:
        place = light, sample_distance
        soft = RaycastRenderer(volume, PATH_FIELDS, *place)
        smooth = smooth_distance(sample_distance, PATH_FIELDS)
        super().__init__(Drawer(soft, sample_distance, smooth_distance=smooth))
        self._curves, self._tracing = RaycastRenderer(volume, PATH_CURVES, *place), tracing
        self._tracer: Engine | None = None
        self._traced_seconds = FIRST_GUESS_S

    def images(self, request: BatchRequest, watch: Watch = UNWATCHED) -> Array:
        """Trace the images if that is requested and fast enough, else draw them in soft light."""
        pixels = request.quality.pixels
        count = pixels.columns * pixels.rows * (1 + len(request.more))
        if not request.traced or self._tracing is None:
            return super().images(request, watch)
        if self._traced_seconds * count > TRACED_SECONDS:
            # The processors may have been busy, so it is tried again another time.
            self._traced_seconds *= FORGOTTEN
            return super().images(request, watch)
        if self._tracer is None:
            self._tracer = self._tracing()
            # The first time includes loading, so it says nothing about the next ones.
            self._tracer.images(replace(request, more=()), watch)
        begun = time.perf_counter()
        images = self._tracer.images(request, watch)
        self._traced_seconds = (time.perf_counter() - begun) / count
        return images

    def close(self) -> None:
        """Release all of them."""
        super().close()
        self._curves.close()
        if self._tracer is not None:
            self._tracer.close()
