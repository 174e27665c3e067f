"""Compile ahead what draws volumes' first images: ``python -m app.prepare_kernels``.

Numba compiles a renderer for each light and type of voxels when it is first used, which takes ten
seconds or more, while the window shows nothing new. The Makefile runs this once, on all processors;
what is left out is compiled when it is first used.
"""

from __future__ import annotations

import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

import numpy as np

from app.engines.engine import Engine
from app.engines.engines import REAL_BUILDERS, ReferenceSettings
from app.engines.messages import (
    BatchRequest,
    ImageRequest,
    Quality,
    RegionSensitivityRequest,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
)
from model.kernel_cache import kernel_folder
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting
from model.scene.view import View
from model.scene.volume import Volume

COMMON: tuple[tuple[str, Lighting], ...] = (
    ("uint8", "path"),
    ("uint8", "shadows"),
    ("float32", "shadows"),
    ("uint8", "soft"),
    ("uint8", "direct"),
    ("float32", "direct"),
    ("int16", "direct"),
    ("uint8", "none"),
    ("float32", "none"),
)
"""Types of voxels and lights that are prepared, those that take longest first."""

EDGE, PIXELS = 24, 16


def prepare(voxels: str, lighting: Lighting) -> None:
    """Draw a small ball, and answer what the window asks of an image, as the window does.

    Parameters
    ----------
    voxels : str
        Type of the voxels.
    lighting : {"none", "direct", "soft", "shadows", "path"}
    """
    volume = _ball(voxels)
    settings = ReferenceSettings(lighting, renderer="raycast")
    for build in (REAL_BUILDERS.reference, REAL_BUILDERS.analyst):
        engine = build(volume, settings)
        try:
            _draw(engine, volume)
            if build is REAL_BUILDERS.analyst:
                _answer(engine, volume)
        finally:
            engine.close()


def _draw(engine: Engine, volume: Volume) -> None:
    for live in (True, False):
        engine.image(ImageRequest(0, _inputs(volume), Quality(PIXELS, live=live)))


def _answer(engine: Engine, volume: Volume) -> None:
    asked = 0, _inputs(volume), Quality(PIXELS)
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


def main() -> int:
    """Prepare the common kernels unless that was done before; return the exit code 0."""
    stamp = kernel_folder() / "prepared"
    if stamp.exists():
        return 0
    begun = time.perf_counter()
    print("Compiling the renderers for this processor, which takes a minute or two, once …")
    # Processes, as Numba compiles on one thread at a time.
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        jobs = {pool.submit(prepare, *one): one for one in COMMON}
        for job in as_completed(jobs):
            if job.exception() is not None:
                voxels, lighting = jobs[job]
                # The program runs without it all the same.
                print(f"{voxels}, {lighting}: {job.exception()}", file=sys.stderr)
    try:
        stamp.touch()
    except OSError as error:
        print(f"Nothing compiled could be kept: {error}", file=sys.stderr)
    print(f"… done in {time.perf_counter() - begun:.0f} s.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
