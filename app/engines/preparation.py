"""What a window asks of a renderer, asked once so that its kernels are compiled."""

from __future__ import annotations

from typing import cast

import numpy as np

from app.engines.engines import REAL_BUILDERS, ReferenceSettings
from app.engines.quality import Quality
from app.engines.requests import (
    BatchRequest,
    Engine,
    ImageRequest,
    RegionSensitivityRequest,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
)
from model.kernel_cache import KernelGroup
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting
from model.scene.view import View
from model.scene.volume import Volume

EDGE, PIXELS = 24, 16


def prepare(group: KernelGroup) -> None:
    """Draw a small ball as the window does, or answer what it asks of images."""
    volume = _ball(group.voxels)
    settings = ReferenceSettings(cast("Lighting", group.lighting), renderer="raycast")
    is_of_images = group.purpose == "images"
    build = REAL_BUILDERS.reference if is_of_images else REAL_BUILDERS.analyst
    engine = build(volume, settings)
    try:
        (_draw if is_of_images else _answer)(engine, volume)
    finally:
        engine.close()


def _draw(engine: Engine, volume: Volume) -> None:
    for live in (True, False):
        engine.image(ImageRequest(_inputs(volume), Quality(PIXELS, live=live)))


def _answer(engine: Engine, volume: Volume) -> None:
    asked = _inputs(volume), Quality(PIXELS)
    whole = Region(0, 0, PIXELS, PIXELS)
    width, values = 6.0, volume.scalar_range
    engine.visibility(VisibilityRequest(*asked, (whole,)))
    engine.value_visibility(ValueVisibilityRequest(*asked, values, width))
    engine.value_sensitivity(ValueSensitivityRequest(*asked, values, width))
    engine.region_sensitivity(RegionSensitivityRequest(*asked, whole, width))
    # Of a map, and of the axes that may be up.
    engine.images(BatchRequest(*asked))


def _inputs(volume: Volume) -> SceneInputs:
    tf = default_transfer_function(volume)
    return SceneInputs(View(30.0, 20.0), tf.opacity, tf.color)


def _ball(voxels: str) -> Volume:
    place = np.linspace(-1.0, 1.0, EDGE)
    radii = np.sqrt(place[:, None, None] ** 2 + place[:, None] ** 2 + place**2)
    return Volume((100.0 * np.clip(1.2 - radii, 0.0, 1.0)).astype(voxels))
