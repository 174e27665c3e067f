"""What features cost in a picture that does without them.

With ``--probe`` it is one picture in a process of its own, which has compiled nothing before, and
has loaded nothing but the standard library.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
REPEATS = 15
RAYCAST = "model.rendering.raycast"

FEATURES = {
    "direct light": (f"{RAYCAST}.shading",),
    "soft light": (f"{RAYCAST}.illumination", f"{RAYCAST}.shading:received"),
    "path-traced light": ("model.rendering.path_tracing",),
    "missing voxels": (f"{RAYCAST}.batch:hide",),
    "VTK": ("vtkmodules", "model.rendering.vtk_renderer"),
    "regions": (*("model.sensitivity", f"{RAYCAST}.differentiation", f"{RAYCAST}.change_norms"),),
    "visible values": (f"{RAYCAST}.tangents",),
    "models": ("torch", "openvino", "model.networks", "model.generator"),
    "map of TFs": ("model.latent", "sklearn"),
    "training": ("model.training", "distributed", "dask"),
    "window": ("PySide6", "pyqtgraph", "app.window"),
    "figures, movies": ("PIL", "imageio", "app.figures"),
    "other formats": ("h5py", "zarr", "pydicom", "nibabel", "tifffile", "mrcfile"),
}
"""Modules, and compiled functions of a module, that only a feature needs."""

SHARED = (f"{RAYCAST}.",)
"""Modules that are loaded with the ray caster, where it is only compiled functions that count."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure in a process of its own."""
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["--probe"]:
        print(json.dumps(probe(Path(words[1]), int(words[2]))))
        return
    from tests.benchmarks.rows import options, paths, print_machine, print_rows

    asked = options(__doc__).parse_args(words)
    print_machine()
    found = _probed(paths(asked)[0], asked.size)
    print_rows(
        f"A plain picture of {asked.size} x {asked.size}, with an input that changes nothing",
        ("input", "time over the plain one's"),
        found["ratios"].items(),
    )
    rows = []
    for feature, own in FEATURES.items():
        modules = tuple(name for name in own if not name.startswith(SHARED))
        loaded = sum(_is_of(name, modules) for name in found["modules"])
        rows.append((feature, loaded, sum(_is_of(name, own) for name in found["kernels"])))
    heading = ("feature", "modules loaded", "functions compiled")
    print_rows(f"Of features that it does without ({found['ms']:.0f} ms)", heading, rows)


def _is_of(name: str, prefixes: tuple[str, ...]) -> bool:
    return any(name == each or name.startswith((f"{each}:", f"{each}.")) for each in prefixes)


def _probed(path: Path, size: int) -> dict[str, Any]:
    command = [sys.executable, "-m", "tests.benchmarks.absent", "--probe"]
    with tempfile.TemporaryDirectory() as cache:
        place = {"XDG_CACHE_HOME": cache, "LOCALAPPDATA": cache, "OMP_WAIT_POLICY": "PASSIVE"}
        done = subprocess.run(
            [*command, str(path.absolute()), str(size)],
            cwd=ROOT,
            env={**os.environ, **place},
            capture_output=True,
            text=True,
            check=True,
        )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def probe(path: Path, size: int) -> dict[str, Any]:
    """Draw the plain picture, and look at what is there; then others that look the same."""
    brought = set(sys.modules)
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.scene.default_tf import default_transfer_function
    from model.scene.inputs import SceneInputs
    from model.scene.view import View
    from model.volume_files import read_volume

    volume = read_volume(path)
    inputs = SceneInputs.of(View(30.0, 20.0), default_transfer_function(volume))
    plain = partial(RaycastRenderer(volume).render, inputs, size)
    plain()
    found: dict[str, Any] = {
        "modules": sorted(set(sys.modules) - brought),
        "kernels": sorted(_kernels()),
    }
    import numpy as np

    from model.rendering.raster import Raster
    from model.scene.crop import CropBox
    from model.scene.scene import LightDirection
    from tests.benchmarks.rows import timed

    known = replace(volume, missing=np.zeros(volume.voxels.shape, dtype=bool))
    renderer = plain.func
    variants: dict[str, Callable[[], object]] = {
        "crop": partial(renderer, replace(inputs, crop=CropBox()), size),
        "light's direction": partial(renderer, replace(inputs, light=LightDirection()), size),
        "wide raster": partial(renderer, inputs, Raster(size, size)),
        "scalar range": partial(
            RaycastRenderer(volume.over(volume.data_range)).render, inputs, size
        ),
        "missing voxels": partial(RaycastRenderer(known).render, inputs, size),
    }
    found["ratios"], times = {}, []
    for name, draw in variants.items():
        draw()
        # One after the other: what else the machine does falls on both.
        pairs = [(timed(plain)[1], timed(draw)[1]) for _ in range(REPEATS)]
        times += [alone for alone, _ in pairs]
        found["ratios"][name] = statistics.median(varied / alone for alone, varied in pairs)
    found["ms"] = 1e3 * statistics.median(times)
    return found


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


if __name__ == "__main__":
    main()
