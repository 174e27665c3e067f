"""A renderer as an engine: images, pictures to save, and sensitivities."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.engines.messages import SupersededError
from app.engines.quality import Quality
from app.engines.requests import (
    UNWATCHED,
    Array,
    BatchRequest,
    ImageRequest,
    PictureRequest,
    RegionSensitivityRequest,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
    Watch,
)
from model.errors import NotOfferedError
from model.scene.scene import RENDERER_NAMES, RendererName
from model.scene.tf_perturbation import edit_over

if TYPE_CHECKING:
    from model.rendering.raster import Raster
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.rendering.renderer import Renderer
    from model.scene.inputs import SceneInputs

FIRST_GUESS_S = 5e-6
"""Expected time per pixel before the first image: that of VTK with gradient shading on a CPU."""

BAND_S, MOST_BANDS = 0.25, 16
"""Time that a band of a final image should take, and the largest number of bands.

A final image is given up between two bands.
"""

TILE = 1024
"""Size of the tiles of pictures to save, in pixels: within what every OpenGL can draw."""


class RendererEngine:
    """VTK or the ray caster as an engine.

    Parameters
    ----------
    sample_distance : float
        Of VTK's images, in voxels.
    name : str
        Which renderer it is, where it does not know itself.
    smooth : float, optional
        Sample distance of the ray caster's images; by default the same.
    """

    scene = None
    draws_codes = False
    image_error: float | None = None

    def __init__(
        self,
        renderer: Renderer,
        sample_distance: float,
        name: RendererName = "raycast",
        smooth: float | None = None,
    ) -> None:
        self._name = name
        self._renderer = renderer
        self._sample_distance = sample_distance
        self._smooth = smooth or sample_distance
        self._seconds_per_pixel = FIRST_GUESS_S

    @property
    def description(self) -> str:
        """Name of the renderer; where another one had to draw, the sentence that says so."""
        name = RENDERER_NAMES["raycast" if self.by_raycast else self._name]
        return getattr(self._renderer, "reason", "") or name

    @property
    def remark(self) -> str:
        """One sentence on why this renderer draws; empty if it was asked for."""
        return getattr(self._renderer, "remark", "")

    @property
    def by_raycast(self) -> bool:
        """Whether the ray caster draws."""
        return getattr(self._renderer, "by_raycast", self._name == "raycast")

    def image(self, request: ImageRequest, watch: Watch = UNWATCHED) -> Array:
        """Render at the request's quality, a band of rows after the other if that takes long."""
        quality, raster = request.quality, request.quality.pixels
        distance = self._distance(quality)
        if quality.live:
            return self._renderer.render(request.inputs, raster, distance)
        expected = self._seconds_per_pixel * raster.columns * raster.rows
        bands = min(math.ceil(expected / BAND_S), MOST_BANDS)
        start = time.perf_counter()
        image = np.empty((*raster.shape, 4), dtype=np.float32)
        for band in raster.tiles(raster.columns, math.ceil(raster.rows / bands)):
            _go_on_if(watch)
            image[band.top : band.bottom] = self._renderer.render(request.inputs, band, distance)
        self._seconds_per_pixel = (time.perf_counter() - start) / (raster.columns * raster.rows)
        return image

    def picture(self, request: PictureRequest, watch: Watch = UNWATCHED) -> NDArray[np.uint8]:
        """Render a picture of any size, tile by tile."""
        whole = request.quality.pixels
        distance = self._distance(request.quality)
        picture = np.empty((whole.height, whole.width, 4), dtype=np.uint8)
        tiles = list(whole.tiles(TILE, TILE))
        for done, tile in enumerate(tiles):
            _go_on_if(watch)
            watch.note(done / len(tiles))
            image = self._renderer.render(request.inputs, tile, distance)
            part = picture[tile.top : tile.bottom, tile.left : tile.right]
            part[...] = np.rint(255 * image)
        return picture

    def images(self, request: BatchRequest, watch: Watch = UNWATCHED) -> Array:
        """Render the images one after the other."""
        # Small pictures: rings are not what one sees in them.
        pixels = request.quality.pixels
        distance = self._sample_distance * request.quality.coarseness
        images = []
        for done, inputs in enumerate((request.inputs, *request.more)):
            _go_on_if(watch)
            watch.note(done / (1 + len(request.more)))
            images.append(self._small(inputs, pixels, distance, watch))
        return np.stack(images)

    def _small(self, inputs: SceneInputs, pixels: Raster, distance: float, _watch: Watch) -> Array:
        """Draw one of several small images."""
        return self._renderer.render(inputs, pixels, distance)

    def region_sensitivity(
        self, request: RegionSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Differentiate the image exactly; not offered by VTK."""
        from model.sensitivity.rendered import region_responses

        _go_on_if(watch)
        renderer, size = self._of_curves(), request.quality.pixels
        with renderer.coarsely_lit(request.quality.live):
            return region_responses(
                renderer, request.inputs, size, request.region, request.width, request.measure
            )

    def value_sensitivity(
        self, request: ValueSensitivityRequest, watch: Watch = UNWATCHED
    ) -> Array:
        """Differentiate the image exactly; not offered by VTK."""
        _go_on_if(watch)
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

        if not isinstance(self._renderer, RaycastRenderer):
            raise NotOfferedError("VTK does not know its derivative; choose the ray caster.")
        return self._renderer

    def _distance(self, quality: Quality) -> float:
        """Return the sample distance of an image, in voxels."""
        usual = self._smooth if self.by_raycast else self._sample_distance
        return usual * quality.coarseness

    def _of_curves(self) -> RaycastRenderer:
        """Return what the curves of regions are of."""
        return self._ray_caster()

    def latent_images(self, request: BatchRequest) -> Array:
        """Not supported: renderers have no latent codes."""
        raise NotOfferedError("A renderer draws no latent codes; decode them to TFs first.")

    def close(self) -> None:
        """Release the OpenGL context or the threads."""
        self._renderer.close()


def _go_on_if(watch: Watch) -> None:
    """Give up an answer that nobody waits for any more."""
    if not watch():
        raise SupersededError
