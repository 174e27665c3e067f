"""A renderer as an engine: images, pictures to save, and sensitivities."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.engines.drawer import Drawer, VtkThread
from app.engines.exactness import distance
from app.engines.pace import SCALES, SOON_SECONDS, Sizes
from app.engines.requests import (
    IMAGES,
    UNWATCHED,
    Array,
    BatchRequest,
    Engine,
    Image,
    ImageRequest,
    PictureRequest,
    RegionSensitivityRequest,
    Request,
    TradeOffRequest,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
    Watch,
)
from model.errors import NotOfferedError
from model.rendering.raster import Raster
from model.rendering.renderer import FallbackRenderer
from model.scene.inputs import SceneInputs
from model.scene.tf_perturbation import edit_over

if TYPE_CHECKING:
    from model.rendering.raycast.renderer import RaycastRenderer

FIELD_DISTANCE = 0.25  # most between samples of fields of changes at rest, in voxels
TILE = 1024  # size of the tiles of saved pictures, in pixels: every OpenGL can draw that
PREVIEW_SECONDS = 1.5  # of the ray caster's image that is shown until VTK's is drawn


class RendererEngine(Engine):
    """One renderer as an engine."""

    _curves: RaycastRenderer | None = None  # that computes the curves of regions, if another one

    def __init__(self, drawer: Drawer) -> None:
        self._drawer = drawer
        self._finest: dict[str, tuple[SceneInputs, Image]] = {}  # by the channel

    @property
    def description(self) -> str:
        """Name of the renderer, or a sentence that says why another one draws."""
        return self._drawer.description

    @property
    def remark(self) -> str:
        """One sentence on why this renderer draws; empty if it was asked for."""
        return self._drawer.remark

    def images_of(self, request: ImageRequest, watch: Watch = UNWATCHED) -> Iterator[Image | None]:
        """Draw one image while something moves; at rest ever finer ones."""
        inputs, whole, channel = request.inputs, request.quality.pixels, request.channel
        if request.quality.live:
            raster = self._moving_raster(whole, request.stop.live_seconds)
            image = self._moving(request, raster, watch)
            self._finest[channel] = inputs, image
            yield image
            return
        finest = self._finest.get(channel)
        width = finest[1].width if finest is not None and finest[0] == inputs else 0
        for finer in self._resting(request, watch, width):
            if finer is not None and not finer.is_preview:
                self._finest[channel] = inputs, finer
            yield finer

    def trade_off(self, request: TradeOffRequest, watch: Watch = UNWATCHED) -> Array:
        """Measure moving images against the image at rest that was drawn last."""
        inputs, truth = self._finest.get(IMAGES, (None, None))
        if truth is None or inputs != request.inputs:
            raise NotOfferedError("Nothing can be measured until the image at rest is drawn.")
        whole = request.quality.pixels
        found: list[tuple[float, float]] = []
        for scale in sorted(SCALES):
            watch.go_on()
            watch.note(len(found) / len(SCALES))
            image = self._moving(request, whole.scaled(scale), watch)
            found.append((image.seconds, distance(image.rgba, truth.rgba)))
        return np.array(found, dtype=np.float32)

    def picture(self, request: PictureRequest, watch: Watch = UNWATCHED) -> NDArray[np.uint8]:
        """Render a picture of any size, tile by tile."""
        whole = request.quality.pixels
        picture = np.empty((whole.height, whole.width, 4), dtype=np.uint8)
        tiles, squares = list(whole.tiles(TILE, TILE)), 0.0
        for done, tile in enumerate(tiles):
            watch.go_on()
            watch.note(done / len(tiles))
            rgba, error = self._tile(request, tile, watch.part(done / len(tiles), 1 / len(tiles)))
            part = picture[tile.top : tile.bottom, tile.left : tile.right]
            part[...] = np.rint(255 * rgba)
            squares += (error or 0.0) ** 2 * tile.rows * tile.columns
            is_estimated = error is not None
        self.image_error = math.sqrt(squares / whole.side**2) if is_estimated else None
        return picture

    def images(self, request: BatchRequest, watch: Watch = UNWATCHED) -> Array:
        """Render the images one after the other."""
        images = []
        for done, inputs in enumerate((request.inputs, *request.more)):
            watch.go_on()
            watch.note(done / (1 + len(request.more)))
            images.append(self._small(request, inputs, watch))
        return np.stack(images)

    def region_sensitivity(
        self, request: RegionSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Differentiate the image exactly."""
        from model.sensitivity.exact import region_responses

        renderer, size = self._curves or self._ray_caster(), request.quality.pixels
        with renderer.asking(watch.go_on, request.quality.live):
            return region_responses(
                renderer, request.inputs, size, request.region, request.width, request.measure
            )

    def value_sensitivity(
        self, request: ValueSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Differentiate the image exactly, at rest with samples close enough to show no rings."""
        renderer, is_live = self._ray_caster(), request.quality.live
        edit = edit_over(request.values, renderer.scalar_range, request.width)
        usual = renderer.sample_distance
        renderer.sample_distance = usual if is_live else min(usual, FIELD_DISTANCE)
        try:
            with renderer.asking(watch.go_on, is_live):
                return renderer.change(request.inputs, request.quality.pixels, edit)
        finally:
            renderer.sample_distance = usual

    def visibility(self, request: VisibilityRequest, watch: Watch = UNWATCHED) -> Array:
        """Compute the visibility of each scalar value."""
        from model.sensitivity.exact import visibility

        renderer, size = self._ray_caster(), request.quality.pixels
        with renderer.asking(watch.go_on):
            found = {
                region: visibility(renderer, request.inputs, size, region)
                for region in dict.fromkeys(request.regions)
            }
        return np.stack([found[region] for region in request.regions])

    def value_visibility(self, request: ValueVisibilityRequest, watch: Watch = UNWATCHED) -> Array:
        """Compute how much of each pixel shows some values, with close samples at rest."""
        from model.rendering.raycast.batch import CLOSE

        renderer = self._ray_caster()
        edit = edit_over(request.values, renderer.scalar_range, request.width)
        weights, pixels = edit / edit.max(), request.quality.pixels
        apart = None if request.quality.live else min(renderer.sample_distance, CLOSE)
        with renderer.asking(watch.go_on):
            return renderer.value_visibility(request.inputs, pixels, weights, apart)

    def forget(self, channel: str) -> None:
        """Free the finest image."""
        self._finest.pop(channel, None)

    def close(self) -> None:
        """Release the OpenGL context or the threads."""
        self._drawer.renderer.close()

    def _moving_raster(self, whole: Raster, seconds: float) -> Raster:
        return self._drawer.moving_raster(whole, seconds)

    def _moving(self, request: Request, raster: Raster, watch: Watch = UNWATCHED) -> Image:
        """Draw an image while something moves."""
        return self._drawer.moving(request.inputs, raster, watch)

    def _resting(self, request: ImageRequest, watch: Watch, width: int) -> Iterator[Image | None]:
        """Draw ever finer images, given the width of the one that is shown."""
        return self._drawer.resting(request, watch, width)

    def _tile(
        self, request: PictureRequest, tile: Raster, watch: Watch
    ) -> tuple[Array, float | None]:
        """Draw a tile of a picture to save, and estimate its error if it has one."""
        return self._own(watch).picture(request.inputs, tile, watch), None

    def _small(self, request: BatchRequest, inputs: SceneInputs, watch: Watch) -> Array:
        """Draw one of several small images; thin layers have speckles while something moves."""
        from model.rendering.raycast.renderer import RaycastRenderer

        drawer, quality = self._own(watch), request.quality
        is_quick = quality.live and isinstance(self._drawer.renderer, RaycastRenderer)
        apart = drawer.sample_distance if quality.live else drawer.distance
        with self._ray_caster().asking(is_coarsely_lit=True) if is_quick else nullcontext():
            return drawer.render(inputs, quality.pixels, apart, watch)

    def _own(self, _watch: Watch) -> Drawer:
        """Return what draws at rest."""
        return self._drawer

    def _ray_caster(self) -> RaycastRenderer:
        from model.rendering.raycast.renderer import RaycastRenderer

        assert isinstance(self._drawer.renderer, RaycastRenderer)
        return self._drawer.renderer


class ReferenceEngine(RendererEngine):
    """The ray caster, which draws at once and while something moves, and VTK, which draws at rest.

    VTK is opened after the first image at rest. From then on its image at rest replaces the ray
    caster's. If VTK fails, or would draw on the CPU and should not, the ray caster's image is the
    last. `open_vtk` is called in a thread of its own.
    """

    def __init__(self, drawer: Drawer, open_vtk: Callable[[], FallbackRenderer]) -> None:
        super().__init__(drawer)
        self._open_vtk = open_vtk
        self._vtk: VtkThread | None = None
        self._final: Drawer | None = None

    def _moving(self, request: Request, raster: Raster, watch: Watch = UNWATCHED) -> Image:
        image = super()._moving(request, raster, watch)
        return replace(image, is_preview=self._final is not self._drawer)

    def _resting(self, request: ImageRequest, watch: Watch, width: int) -> Iterator[Image]:
        whole, preview, final = request.quality.pixels, None, self._final
        is_slow = final is None or (not final.by_raycast and final.is_slow(whole))
        if width < whole.width and is_slow:
            limits = SOON_SECONDS, PREVIEW_SECONDS
            for preview in self._drawer.resting(request, watch, width, limits):
                yield replace(preview, is_last=False, is_preview=True)
                width = preview.width
        final = self._own(watch)
        if preview is not None and final.by_raycast and width >= whole.width:
            preview = replace(preview, by=final.description)
            yield from final.finished(request.inputs, preview, whole, watch)
            return
        yield from final.resting(request, watch, width)

    def _own(self, watch: Watch) -> Drawer:
        if self._final is None:
            self._vtk = self._vtk or VtkThread(self._open_vtk)
            vtk, drawer = self._vtk.opened(watch), self._drawer
            if vtk.by_raycast:
                self._drawer = replace(drawer, renderer=vtk, remark=vtk.remark)
                self._final = self._drawer
            else:
                self._final = replace(drawer, renderer=self._vtk, name="vtk", sizes=Sizes())
        return self._final

    def close(self) -> None:
        """Release both."""
        super().close()
        if self._vtk is not None:
            self._vtk.close()
