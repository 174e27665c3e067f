"""One renderer's images: a coarse one while something moves, ever finer ones at rest."""

import math
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeVar

import numpy as np

from app.engines.pace import BRIEF_SECONDS, LONGEST_SECONDS, REST_SECONDS, SOON_SECONDS, Sizes
from app.engines.requests import UNWATCHED, Array, Image, ImageRequest, Watch
from model.measurements import processors
from model.rendering.raster import Raster, fill_white_squares
from model.rendering.ray_places import VISIBLE
from model.rendering.renderer import FallbackRenderer, Renderer
from model.scene.inputs import SceneInputs
from model.scene.scene import RENDERER_NAMES, RendererName

FIRST_GUESS_S = 5e-6  # assumed before the first image: VTK's with shading on a CPU

BAND_S, MOST_BANDS = 0.1, 32
"""Time that a band of VTK's final image should take, and the largest number of bands.

An image can be cancelled between two bands; the ray caster's at any time."""

LIVE_COARSENESS = 4.0
"""Factor of the sample distance in VTK's images while something moves.

The ray caster keeps all samples and draws fewer pixels: in the same time, that is nearer to the
image at rest."""

DENSER = 4  # times as many samples along each ray, where the usual ones are too few for the TF
CHECKED = 12  # one pixel of so many along both sides is drawn with these, too

FEW = 2 / 255
"""Least RMS difference of what is visible by which they are too few. Where a layer is crossed in
less than a step, it shows as a lattice; images of broader ones have up to .0065."""

PATIENCE_S = 0.02  # time between two checks whether an image is still wanted

_T = TypeVar("_T")


@dataclass
class Drawer:
    """Draws by one renderer, at sizes that its measured times allow."""

    renderer: Renderer
    sample_distance: float  # of VTK's images at rest, in voxels
    name: RendererName = "raycast"  # name of the renderer, if it does not know it
    smooth_distance: float | None = None  # of the ray caster's images, if another one
    is_brief: bool = False  # whether every image must be quick, because another renderer draws soon
    remark: str = ""  # one sentence on why this renderer draws; empty if it was asked for
    sizes: Sizes = field(default_factory=Sizes)

    @property
    def description(self) -> str:
        """Name of the renderer, or a sentence that says why another one draws."""
        name = RENDERER_NAMES["raycast" if self.by_raycast else self.name]
        return getattr(self.renderer, "reason", "") or name

    @property
    def by_raycast(self) -> bool:
        """Whether the ray caster draws."""
        return getattr(self.renderer, "by_raycast", self.name == "raycast")

    @property
    def distance(self) -> float:
        """Distance between samples of images at rest, in voxels."""
        smooth = self.smooth_distance if self.by_raycast else None
        return smooth or self.sample_distance

    def is_slow(self, whole: Raster) -> bool:
        """Return whether another renderer's image is shown before the one at rest."""
        return self.sizes.is_slow(self.distance, whole, SOON_SECONDS)

    def moving_raster(self, whole: Raster, seconds: float) -> Raster:
        """Return the size of image that can be drawn in time while something moves."""
        return self.sizes.within(self._moving_distance, whole, seconds)

    def moving(self, inputs: SceneInputs, raster: Raster, watch: Watch = UNWATCHED) -> Image:
        """Draw an image while something moves."""
        image = self._drawn(inputs, raster, self._moving_distance, watch)
        return replace(image, is_preview=self._moving_distance != self.distance)

    def resting(
        self,
        request: ImageRequest,
        watch: Watch,
        width: int = 0,
        preview_limits: Sequence[float] = (),
    ) -> Iterator[Image]:
        """Draw ever finer images."""
        limits = preview_limits or limits_of(request, self.is_brief)
        whole = request.quality.pixels
        coming = self.sizes.at_rest(
            self.distance, whole, width, limits, must_end=not preview_limits
        )
        image, before = None, None
        for raster, is_last in coming:
            if image is not None and raster == before:
                yield replace(image, is_last=is_last)
                return
            before = raster
            expected = self.sizes.expected(self.distance, raster.side) or 0.0
            if self.by_raycast and width < raster.width and expected > SOON_SECONDS:
                image = yield from self._in_halves(request.inputs, raster, watch)
            else:
                image = self._drawn(request.inputs, raster, self.distance, watch, in_bands=True)
            if is_last and not preview_limits and raster.width >= whole.width:
                yield from self.finished(request.inputs, image, raster, watch)
            else:
                yield replace(image, is_last=is_last)

    def finished(
        self, inputs: SceneInputs, image: Image, raster: Raster, watch: Watch
    ) -> Iterator[Image]:
        """Yield an image at rest, and one of more samples if its own are too few."""
        apart = self._apart_for(inputs, image.rgba, raster, watch)
        if apart < self.distance:
            yield replace(image, is_last=False)
            image = replace(self._drawn(inputs, raster, apart, watch), by=image.by)
        yield replace(image, is_last=True)

    def picture(self, inputs: SceneInputs, raster: Raster, watch: Watch) -> Array:
        """Render pixels as at rest."""
        rgba = self.render(inputs, raster, self.distance, watch)
        apart = self._apart_for(inputs, rgba, raster, watch)
        return rgba if apart == self.distance else self.render(inputs, raster, apart, watch)

    def _apart_for(self, inputs: SceneInputs, rgba: Array, raster: Raster, watch: Watch) -> float:
        """Return how far apart the samples of an image must be, given it with the usual ones."""
        if self.smooth_distance is None or not self.by_raycast:
            return self.distance
        columns, rows = (math.ceil(n / CHECKED) for n in (raster.columns, raster.rows))
        part = replace(raster, columns=columns, rows=rows, step=CHECKED)
        dense = self.render(inputs, part, self.distance / DENSER, watch)
        seen = dense[..., 3] > VISIBLE
        changes = (dense - rgba[::CHECKED, ::CHECKED])[seen]
        are_few = len(changes) > 0 and float(np.sqrt(np.mean(changes**2))) > FEW
        return self.distance / DENSER if are_few else self.distance

    def render(
        self, inputs: SceneInputs, raster: Raster, distance: float, watch: Watch = UNWATCHED
    ) -> Array:
        """Render pixels with a sample distance; stop early if the image is no longer wanted."""
        return self.renderer.render(inputs, raster, distance, go_on=watch.go_on)

    def _drawn(
        self,
        inputs: SceneInputs,
        raster: Raster,
        distance: float,
        watch: Watch,
        in_bands: bool = False,
    ) -> Image:
        draw = self._in_bands if in_bands and not self.by_raycast else self.render
        image = self._image(partial(draw, inputs, raster, distance, watch))
        self.sizes.note(distance, raster.side, image.seconds)
        return image

    def _in_halves(
        self, inputs: SceneInputs, raster: Raster, watch: Watch
    ) -> Generator[Image, None, Image]:
        """Yield an image of half the pixels, in a chessboard pattern; return the whole image."""
        rgba = np.zeros((*raster.shape, 4), dtype=np.float32)

        def drawn(squares: tuple[tuple[int, int], ...]) -> Array:
            for row, column in squares:
                part = raster.every_second(row, column)
                rgba[row::2, column::2] = self.render(inputs, part, self.distance, watch)
            return rgba

        half = self._image(partial(drawn, ((0, 0), (1, 1))))
        shown = half.rgba.copy()
        fill_white_squares(shown)
        # Without a time by which the light would be judged: it is half an image.
        yield replace(half, rgba=shown, is_last=False, is_preview=True, quiet_seconds=None)
        rest = self._image(partial(drawn, ((0, 1), (1, 0))))
        seconds = half.seconds + rest.seconds
        quiet = (half.quiet_seconds or 0.0) + (rest.quiet_seconds or 0.0)
        self.sizes.note(self.distance, raster.side, seconds)
        return replace(rest, seconds=seconds, quiet_seconds=quiet)

    def _image(self, draw: Callable[[], Array]) -> Image:
        begun, worked = time.perf_counter(), time.process_time()
        rgba = draw()
        seconds = time.perf_counter() - begun
        quiet = min((time.process_time() - worked) / processors(), seconds)
        return Image(
            rgba, seconds, self.description, by_raycast=self.by_raycast, quiet_seconds=quiet
        )

    def _in_bands(
        self, inputs: SceneInputs, raster: Raster, distance: float, watch: Watch
    ) -> Array:
        expected = self.sizes.expected(distance, raster.side)
        seconds = expected or FIRST_GUESS_S * raster.columns * raster.rows
        bands = min(math.ceil(seconds / BAND_S), MOST_BANDS)
        rgba = np.empty((*raster.shape, 4), dtype=np.float32)
        for band in raster.tiles(raster.columns, math.ceil(raster.rows / bands)):
            watch.go_on()
            rgba[band.top : band.bottom] = self.render(inputs, band, distance, watch)
        return rgba

    @property
    def _moving_distance(self) -> float:
        return self.distance * (1.0 if self.by_raycast else LIVE_COARSENESS)


class VtkThread:
    """A thread that opens, uses and closes VTK."""

    def __init__(self, open_vtk: Callable[[], FallbackRenderer]) -> None:
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="vtk")
        self._opening = self._thread.submit(open_vtk)
        self.sample_distance = 0.0

    def opened(self, watch: Watch) -> FallbackRenderer:
        """Wait until it is open, and return it."""
        vtk = _awaited(self._opening, watch.go_on)
        self.sample_distance = vtk.sample_distance
        return vtk

    @property
    def reason(self) -> str:
        """Sentence on why VTK failed, so that the ray caster draws; empty if it did not."""
        return self._opening.result().reason

    @property
    def by_raycast(self) -> bool:
        """Whether the ray caster draws."""
        return self._opening.result().by_raycast

    def render(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        *,
        go_on: Callable[[], object] | None = None,
    ) -> Array:
        """Render one image; stop waiting once it is no longer wanted."""
        vtk = self._opening.result()
        if vtk.by_raycast:
            # VTK has failed meanwhile; the ray caster runs in this thread, as it also draws what
            # moves.
            return vtk.render(inputs, size, sample_distance, go_on=go_on)
        return _awaited(self._thread.submit(vtk.render, inputs, size, sample_distance), go_on)

    def close(self) -> None:
        """Release VTK, once it has drawn what it was asked for."""
        self._thread.submit(lambda: self._opening.result().close())
        self._thread.shutdown()


def limits_of(request: ImageRequest, is_brief: bool = False) -> tuple[float, ...]:
    """Return the seconds that each of the images at rest may take."""
    if is_brief:
        return SOON_SECONDS, BRIEF_SECONDS
    if request.is_fixed:
        return SOON_SECONDS, math.inf
    return SOON_SECONDS, REST_SECONDS, LONGEST_SECONDS


def _awaited(coming: Future[_T], go_on: Callable[[], object] | None) -> _T:
    while not wait([coming], PATIENCE_S).done:
        if go_on is not None:
            go_on()
    return coming.result()
