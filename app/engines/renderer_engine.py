"""A renderer as an engine: images, pictures to save, and sensitivities."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.engines.drawer import Drawer, go_on_if
from app.engines.image import Image
from app.engines.requests import (
    UNWATCHED,
    Array,
    BatchRequest,
    ImageRequest,
    PictureRequest,
    RegionSensitivityRequest,
    Request,
    TradeRequest,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
    Watch,
)
from app.engines.trade import traded
from model.errors import NotOfferedError
from model.scene.tf_perturbation import edit_over

if TYPE_CHECKING:
    from model.rendering.raster import Raster
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.scene.inputs import SceneInputs

TILE = 1024
"""Size of the tiles of pictures to save, in pixels: within what every OpenGL can draw."""


class RendererEngine:
    """One renderer as an engine.

    Parameters
    ----------
    drawer : Drawer
        Draws its images.
    """

    scene = None
    draws_codes = False
    image_error: float | None = None

    def __init__(self, drawer: Drawer) -> None:
        self._drawer = drawer
        self._finest: tuple[SceneInputs, Image] | None = None

    @property
    def description(self) -> str:
        """Name of the renderer; where another one had to draw, the sentence that says so."""
        return self._drawer.description

    @property
    def remark(self) -> str:
        """One sentence on why this renderer draws; empty if it was asked for."""
        return self._drawer.remark

    def images_of(self, request: ImageRequest, watch: Watch = UNWATCHED) -> Iterator[Image]:
        """Draw one image while something moves; at rest ever finer ones.

        None is coarser than what has been drawn of the same scene.
        """
        inputs, whole = request.inputs, request.quality.pixels
        if request.quality.live:
            raster = self._moving_raster(whole, request.stop.live_seconds)
            image = self._moving(request, raster, watch)
            self._finest = inputs, image
            yield image
            return
        if self._finest is not None and self._finest[0] != inputs:
            self._finest = None
        width = 0 if self._finest is None else self._finest[1].width
        for image in self._resting(request, watch, width):
            if not image.stands_in:
                self._finest = inputs, image
            yield image

    def trade(self, request: TradeRequest, watch: Watch = UNWATCHED) -> Array:
        """Measure images while something moves against the one at rest that was drawn last."""
        if self._finest is None or self._finest[0] != request.inputs:
            raise NotOfferedError("There is no image at rest to measure others against.")
        whole, (_inputs, truth) = request.quality.pixels, self._finest
        return traded(partial(self._moving, request, watch=watch), whole, truth.rgba, watch)

    def _moving_raster(self, whole: Raster, seconds: float) -> Raster:
        return self._drawer.moving_raster(whole, seconds)

    def _moving(self, request: Request, raster: Raster, watch: Watch = UNWATCHED) -> Image:
        """Draw an image while something moves."""
        return self._drawer.moving(request.inputs, raster)

    def _resting(self, request: ImageRequest, watch: Watch, width: int) -> Iterator[Image]:
        """Draw ever finer images, where one of a width is shown."""
        return self._drawer.resting(request, watch, width)

    def _own(self) -> Drawer:
        """Return what draws at rest."""
        return self._drawer

    def picture(self, request: PictureRequest, watch: Watch = UNWATCHED) -> NDArray[np.uint8]:
        """Render a picture of any size, tile by tile."""
        whole = request.quality.pixels
        drawer = self._own()
        picture = np.empty((whole.height, whole.width, 4), dtype=np.uint8)
        tiles = list(whole.tiles(TILE, TILE))
        for done, tile in enumerate(tiles):
            go_on_if(watch)
            watch.note(done / len(tiles))
            image = drawer.renderer.render(request.inputs, tile, drawer.distance)
            part = picture[tile.top : tile.bottom, tile.left : tile.right]
            part[...] = np.rint(255 * image)
        return picture

    def images(self, request: BatchRequest, watch: Watch = UNWATCHED) -> Array:
        """Render the images one after the other."""
        # Small pictures: rings are not what one sees in them.
        pixels = request.quality.pixels
        distance = self._own().sample_distance * request.quality.coarseness
        images = []
        for done, inputs in enumerate((request.inputs, *request.more)):
            go_on_if(watch)
            watch.note(done / (1 + len(request.more)))
            images.append(self._small(inputs, pixels, distance, watch))
        return np.stack(images)

    def _small(self, inputs: SceneInputs, pixels: Raster, distance: float, _watch: Watch) -> Array:
        """Draw one of several small images."""
        return self._own().renderer.render(inputs, pixels, distance)

    def region_sensitivity(
        self, request: RegionSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Differentiate the image exactly; not offered by VTK."""
        from model.sensitivity.exact import region_responses

        go_on_if(watch)
        renderer, size = self._of_curves(), request.quality.pixels
        with renderer.coarsely_lit(request.quality.live):
            return region_responses(
                renderer, request.inputs, size, request.region, request.width, request.measure
            )

    def value_sensitivity(
        self, request: ValueSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Differentiate the image exactly; not offered by VTK."""
        go_on_if(watch)
        renderer = self._ray_caster()
        edit = edit_over(request.values, renderer.scalar_range, request.width)
        with renderer.coarsely_lit(request.quality.live):
            return renderer.change(request.inputs, request.quality.pixels, edit)

    def visibility(self, request: VisibilityRequest) -> Array:
        """Return the visibility of each scalar value; not offered by VTK."""
        from model.sensitivity.exact import visibility

        renderer, size = self._ray_caster(), request.quality.pixels
        found = {
            region: visibility(renderer, request.inputs, size, region)
            for region in dict.fromkeys(request.regions)
        }
        return np.stack([found[region] for region in request.regions])

    def value_visibility(self, request: ValueVisibilityRequest) -> Array:
        """Return how much of each pixel shows some values; not offered by VTK."""
        renderer = self._ray_caster()
        edit = edit_over(request.values, renderer.scalar_range, request.width)
        return renderer.value_visibility(request.inputs, request.quality.pixels, edit / edit.max())

    def _ray_caster(self) -> RaycastRenderer:
        from model.rendering.raycast.renderer import RaycastRenderer

        if not isinstance(self._drawer.renderer, RaycastRenderer):
            raise NotOfferedError("VTK does not know its derivative; choose the ray caster.")
        return self._drawer.renderer

    def _of_curves(self) -> RaycastRenderer:
        """Return what the curves of regions are of."""
        return self._ray_caster()

    def latent_images(self, request: BatchRequest) -> Array:
        """Not supported: renderers have no latent codes."""
        raise NotOfferedError("A renderer draws no latent codes; decode them to TFs first.")

    def close(self) -> None:
        """Release the OpenGL context or the threads."""
        self._drawer.renderer.close()
