"""Compilation of a group of kernels, by one request of each kind that the window makes."""

from contextlib import closing
from typing import cast

import numpy as np

from app.engines.drawer import Drawer
from app.engines.renderer_engine import RendererEngine
from app.engines.requests import (
    ImageRequest,
    Quality,
    RegionSensitivityRequest,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
)
from model.kernel_cache import KernelGroup
from model.latent.tiny_pictures import overview_of
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting
from model.scene.transfer_function import TF_SAMPLES
from model.scene.view import View
from model.scene.volume import Volume

EDGE, PIXELS = 24, 16


def prepare(group: KernelGroup) -> None:
    """Draw a small ball as the window does, or answer its questions about images."""
    volume = _ball(group.voxels)
    if group.lighting == "path":
        from model.rendering.path_tracing.renderer import PathTracer

        tracer = PathTracer(volume)
        tracer.render(_inputs(volume), PIXELS)
        tracer.close()
        return
    # Only the ray caster: everything else loads quickly.
    from model.rendering.raycast.renderer import RaycastRenderer

    renderer = RaycastRenderer(volume, cast("Lighting", group.lighting))
    with closing(RendererEngine(Drawer(renderer, renderer.sample_distance))) as engine:
        (_draw if group.purpose == "images" else _answer)(engine, volume)


def _draw(engine: RendererEngine, volume: Volume) -> None:
    for live in (True, False):
        list(engine.images_of(ImageRequest(_inputs(volume), Quality(PIXELS, live=live))))


def _answer(engine: RendererEngine, volume: Volume) -> None:
    asked = _inputs(volume), Quality(PIXELS)
    whole = Region(0, 0, PIXELS, PIXELS)
    width, values = 6.0, volume.scalar_range
    engine.visibility(VisibilityRequest(*asked, (whole,)))
    engine.value_visibility(ValueVisibilityRequest(*asked, values, width))
    engine.value_sensitivity(ValueSensitivityRequest(*asked, values, width))
    engine.region_sensitivity(RegionSensitivityRequest(*asked, whole, width))
    # What the map of TFs shows.
    overview_of(volume, _inputs(volume), np.zeros((1, TF_SAMPLES)), PIXELS)


def _inputs(volume: Volume) -> SceneInputs:
    tf = default_transfer_function(volume)
    return SceneInputs(View(30.0, 20.0), tf.opacity, tf.color)


def _ball(voxels: str) -> Volume:
    place = np.linspace(-1.0, 1.0, EDGE)
    radii = np.sqrt(place[:, None, None] ** 2 + place[:, None] ** 2 + place**2)
    return Volume((100.0 * np.clip(1.2 - radii, 0.0, 1.0)).astype(voxels))
