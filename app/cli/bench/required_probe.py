"""A picture in a process of its own: ``python -m app.cli.bench.required_probe FILE [FEATURE]``.

Without a feature it prints what a plain picture costs and what is loaded for it; with one, what the
feature's first use costs after that.
"""

from __future__ import annotations

import json
import os
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

SIZE = 256
REPEATS = 15

Draw = Callable[[], object]


def probe(path: Path, feature: str | None) -> dict[str, Any]:
    """Draw the plain picture, then use a feature for the first time, or look at what is there.

    Returns
    -------
    dict
        Of the plain picture "seconds" of the first, with the compilation, "ms" of another, "memory"
        in MB, "modules" that are loaded, "kernels" that were compiled, as ``module:function``, and
        "ratios": the time with each input present but neutral. With a feature "seconds" of its
        first use, "ms" of the second, and the "memory", "modules" and "kernels" that it added.
    """
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.scene.default_tf import default_transfer_function
    from model.scene.inputs import SceneInputs
    from model.scene.view import View
    from model.volume_files import read_volume

    volume = read_volume(path)
    tf = default_transfer_function(volume)
    inputs = SceneInputs(View(30.0, 20.0), tf.opacity, tf.color)
    begun = time.perf_counter()
    renderer = RaycastRenderer(volume)
    plain = partial(renderer.render, inputs, SIZE)
    plain()
    first = time.perf_counter() - begun
    if feature is None:
        loaded = sorted(sys.modules)
        kernels = _kernels()
        ratios = _neutral_ratios(renderer, volume, inputs, plain)
        return {
            "seconds": first,
            "ms": 1e3 * _timed(plain),
            "memory": _memory(),
            "modules": loaded,
            "kernels": sorted(kernels),
            "added_by_neutral": sorted(_kernels() - kernels),
            "ratios": ratios,
        }
    before = _memory(), set(sys.modules), _kernels()
    begun = time.perf_counter()
    use = USES[feature](path, volume, inputs, renderer)
    use()
    return {
        "seconds": time.perf_counter() - begun,
        "ms": 1e3 * _timed(use, 3),
        "memory": _memory() - before[0],
        "modules": sorted(set(sys.modules) - before[1]),
        "kernels": sorted(_kernels() - before[2]),
    }


def _neutral_ratios(renderer: Any, volume: Any, inputs: Any, plain: Draw) -> dict[str, float]:
    """Time of pictures with inputs that change nothing, over that of the plain one."""
    import numpy as np

    from model.rendering.raster import Raster
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.scene.crop import CropBox
    from model.scene.light import LightDirection

    nothing = np.zeros(volume.voxels.shape, dtype=bool)
    whole = RaycastRenderer(volume.over(volume.data_range))
    known = RaycastRenderer(replace(volume, missing=nothing))
    lit = replace(inputs, light=LightDirection())
    variants: dict[str, Draw] = {
        "crop": partial(renderer.render, replace(inputs, crop=CropBox()), SIZE),
        "light's direction": partial(renderer.render, lit, SIZE),
        "wide raster": partial(renderer.render, inputs, Raster(SIZE, SIZE)),
        "scalar range": partial(whole.render, inputs, SIZE),
        "missing voxels": partial(known.render, inputs, SIZE),
    }
    ratios: dict[str, list[float]] = {name: [] for name in variants}
    for name, draw in variants.items():
        draw()
        for _ in range(REPEATS):
            # One after the other: what else the machine does falls on both.
            alone = _timed(plain, 1)
            ratios[name].append(_timed(draw, 1) / alone)
    return {name: statistics.median(found) for name, found in ratios.items()}


def _lit(lighting: Any, _path: Path, volume: Any, inputs: Any, _renderer: Any) -> Draw:
    from model.rendering.renderer import open_renderer

    return partial(open_renderer("raycast", volume, lighting).render, inputs, SIZE)


def _path_traced(_path: Path, volume: Any, inputs: Any, _renderer: Any) -> Draw:
    from model.rendering.path_tracing.renderer import PathTracer

    return partial(PathTracer(volume, samples=1).render, inputs, SIZE)


def _preintegrated(_path: Path, volume: Any, inputs: Any, _renderer: Any) -> Draw:
    from model.rendering.renderer import open_renderer

    return partial(open_renderer("raycast", volume, preintegrated=True).render, inputs, SIZE)


def _vtk(_path: Path, volume: Any, inputs: Any, _renderer: Any) -> Draw:
    from model.rendering.renderer import open_renderer

    return partial(open_renderer("vtk", volume).render, inputs, SIZE)


def _missing(_path: Path, volume: Any, inputs: Any, _renderer: Any) -> Draw:
    from model.rendering.raycast.renderer import RaycastRenderer

    missing = volume.voxels == volume.data_range[0]
    return partial(RaycastRenderer(replace(volume, missing=missing)).render, inputs, SIZE)


def _region(_path: Path, _volume: Any, inputs: Any, renderer: Any) -> Draw:
    from model.scene.region import Region
    from model.sensitivity.rendered import region_responses

    return partial(region_responses, renderer, inputs, SIZE, Region(64, 64, 192, 192), 6.0)


def _field(_path: Path, volume: Any, inputs: Any, renderer: Any) -> Draw:
    from model.scene.tf_perturbation import edit_around

    lo, hi = volume.scalar_range
    edit = edit_around((lo + hi) / 2, (lo, hi), 6.0)
    return partial(renderer.change, inputs, SIZE, edit)


def _model(_path: Path, _volume: Any, _inputs: Any, _renderer: Any) -> Draw:
    import numpy as np

    from model.generator.catalog import shipped_models
    from model.generator.generator import Generator
    from model.scene.inputs import draw_inputs

    generator = Generator.load(shipped_models()[0])
    drawn = draw_inputs(np.random.default_rng(0), generator.scene)
    return partial(generator.render, drawn)


def _latent(_path: Path, volume: Any, _inputs: Any, _renderer: Any) -> Draw:
    import numpy as np

    from model.latent.latent_space import LatentSpace

    space = LatentSpace.shipped(volume.scalar_range, volume.scalar_range)
    return partial(space.tf_of, np.zeros(8, dtype=np.float32))


def _compact(_path: Path, volume: Any, _inputs: Any, _renderer: Any) -> Draw:
    from model.volume_files.voxel_code import encode_voxels

    return partial(encode_voxels, volume.voxels[:16], volume.voxels[:16].size // 16)


USES: dict[str, Callable[[Path, Any, Any, Any], Draw]] = {
    "direct light": partial(_lit, "direct"),
    "soft light": partial(_lit, "soft"),
    "shadows": partial(_lit, "shadows"),
    "path-traced light": _path_traced,
    "pre-integration": _preintegrated,
    "missing voxels": _missing,
    "VTK": _vtk,
    "regions": _region,
    "visible values": _field,
    "models": _model,
    "map of TFs": _latent,
    "compact volumes": _compact,
}


def _timed(draw: Draw, repeats: int = REPEATS) -> float:
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        draw()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def _kernels() -> set[str]:
    """Functions of the model that this process has compiled, as ``module:function``."""
    from numba.core.dispatcher import Dispatcher

    return {
        f"{item.py_func.__module__}:{item.py_func.__name__}"
        for name, module in list(sys.modules.items())
        if name.startswith("model.")
        for item in list(vars(module).values())
        if isinstance(item, Dispatcher) and item.signatures
    }


def _memory() -> float:
    """Largest resident memory of this process so far, in MB."""
    import resource

    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest / 1e6 if sys.platform == "darwin" else largest * 1024 / 1e6


if __name__ == "__main__":
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    print(json.dumps(probe(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else None)))
