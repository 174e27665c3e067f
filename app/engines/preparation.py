"""The questions that a window asks of a renderer, asked once so that kernels are compiled."""

from __future__ import annotations

import math
import time
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
from model.rendering.path_tracing import denoising
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.region import Region
from model.scene.scene import Lighting
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import SCAN

EDGE, PIXELS = 24, 16

MEASURED, REPEATED = 256, 3
"""Sides of a picture whose time is measured, and how often it is drawn."""


def prepare(voxels: str, lighting: str) -> None:
    """Draw a small ball, and answer what the window asks of an image, as the window does.

    Parameters
    ----------
    voxels : str
        Type of the voxels.
    lighting : {"none", "direct", "soft", "path"}
    """
    volume = _ball(voxels)
    settings = ReferenceSettings(cast("Lighting", lighting), renderer="raycast")
    for build in (REAL_BUILDERS.reference, REAL_BUILDERS.analyst):
        engine = build(volume, settings)
        try:
            _draw(engine, volume)
            if build is REAL_BUILDERS.analyst:
                _answer(engine, volume)
        finally:
            engine.close()


def measure_path_light() -> float:
    """Return the seconds of a path-traced picture of one sample, as while something moves.

    Of 256 x 256 pixels of the shipped scan, with what finishes it; infinite where nothing does.
    """
    if not denoising.installed():
        return math.inf
    volume = read_volume(SCAN)
    engine = REAL_BUILDERS.reference(volume, ReferenceSettings("path", LightDirection()))
    try:
        request = ImageRequest(_inputs(volume), Quality(MEASURED, live=True), is_measured=True)
        times = []
        for _ in range(REPEATED):
            begun = time.perf_counter()
            engine.image(request)
            times.append(time.perf_counter() - begun)
        return min(times)
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
