"""What inputs and features cost in a picture that does without them, and their first use.

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
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
REPEATS = 15
RAYCAST = "model.rendering.raycast"

Draw = Callable[[], object]


@dataclass(frozen=True)
class Feature:
    """A feature, and the modules and compiled functions that only it needs."""

    name: str
    modules: tuple[str, ...] = ()
    kernels: tuple[str, ...] = ()
    use: Callable[..., Draw] | None = None

    def found(self, probe: dict[str, Any]) -> tuple[int, int]:
        """Return how many of them a process has."""
        own = tuple(name for name in self.modules if name.startswith("model."))
        return (
            sum(_is_of(name, self.modules, ".") for name in probe["modules"]),
            sum(_is_of(name, (*self.kernels, *own), ":") for name in probe["kernels"]),
        )


def _is_of(name: str, prefixes: tuple[str, ...], separator: str) -> bool:
    return any(name == each or name.startswith((each + separator, each + ".")) for each in prefixes)


def _lit(lighting: Any, volume: Any, inputs: Any, _renderer: Any, size: int) -> Draw:
    from model.rendering.raycast.renderer import RaycastRenderer

    return partial(RaycastRenderer(volume, lighting).render, inputs, size)


def _path_traced(volume: Any, inputs: Any, _renderer: Any, size: int) -> Draw:
    from model.rendering.path_tracing.renderer import PathTracer

    return partial(PathTracer(volume, samples=1).render, inputs, size)


def _missing(volume: Any, inputs: Any, _renderer: Any, size: int) -> Draw:
    from model.rendering.raycast.renderer import RaycastRenderer

    missing = volume.voxels == volume.data_range[0]
    return partial(RaycastRenderer(replace(volume, missing=missing)).render, inputs, size)


def _vtk(volume: Any, inputs: Any, _renderer: Any, size: int) -> Draw:
    from model.rendering.renderer import open_renderer

    return partial(open_renderer("vtk", volume).render, inputs, size)


def _region(_volume: Any, inputs: Any, renderer: Any, size: int) -> Draw:
    from model.scene.region import Region
    from model.sensitivity.exact import region_responses

    part = Region(size // 4, size // 4, 3 * size // 4, 3 * size // 4)
    return partial(region_responses, renderer, inputs, size, part, 6.0)


def _field(volume: Any, inputs: Any, renderer: Any, size: int) -> Draw:
    from model.scene.tf_perturbation import edit_around

    lo, hi = volume.scalar_range
    return partial(renderer.change, inputs, size, edit_around((lo + hi) / 2, (lo, hi), 6.0))


def _model(*_scene: Any) -> Draw:
    import numpy as np

    from model.generator.catalog import shipped_models
    from model.generator.generator import Generator
    from model.scene.inputs import draw_inputs

    generator = Generator.load(shipped_models()[0])
    return partial(generator.render, draw_inputs(np.random.default_rng(0), generator.scene))


def _latent(volume: Any, *_others: Any) -> Draw:
    import numpy as np

    from model.latent.latent_space import LatentSpace

    space = LatentSpace.shipped(volume.scalar_range, volume.scalar_range)
    return partial(space.tf_of, np.zeros(8, dtype=np.float32))


FEATURES = (
    Feature("direct light", (), (f"{RAYCAST}.shading",), partial(_lit, "direct")),
    Feature(
        "soft light",
        (),
        (f"{RAYCAST}.illumination", f"{RAYCAST}.shading:received"),
        partial(_lit, "soft"),
    ),
    Feature("path-traced light", ("model.rendering.path_tracing",), (), _path_traced),
    Feature("missing voxels", (), (f"{RAYCAST}.batch:hide",), _missing),
    Feature("VTK", ("vtkmodules", "model.rendering.vtk_renderer"), (), _vtk),
    Feature(
        "regions",
        ("model.sensitivity", f"{RAYCAST}.differentiation", f"{RAYCAST}.change_norms"),
        (),
        _region,
    ),
    Feature("visible values", ("model.sensitivity", f"{RAYCAST}.tangents"), (), _field),
    Feature("models", ("torch", "openvino", "model.networks", "model.generator"), (), _model),
    Feature("map of TFs", ("model.latent", "sklearn"), (), _latent),
    Feature("training", ("model.training", "distributed", "dask")),
    Feature("window", ("PySide6", "pyqtgraph", "app.window")),
    Feature("figures, movies", ("PIL", "imageio", "app.figures")),
    Feature("other formats", ("h5py", "zarr", "pydicom", "nibabel", "tifffile", "mrcfile")),
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure in processes of their own."""
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["--probe"]:
        _, feature, volume, size = words
        print(json.dumps(probe(Path(volume), feature, int(size))))
        return
    from tests.benchmarks.rows import options, paths, print_machine, print_rows

    parser = options(__doc__)
    parser.add_argument("--used", action="store_true", help="also the first use of each feature")
    asked = parser.parse_args(words)
    print_machine()
    path = paths(asked)[0]
    plain = _probed(path, "", asked.size)
    print_rows(
        f"A plain picture of {asked.size} x {asked.size}, with an input that changes nothing",
        ("input", "time over the plain one's"),
        plain["ratios"].items(),
    )
    rows = []
    for feature in FEATURES:
        row: tuple[object, ...] = (feature.name, *feature.found(plain))
        if asked.used and feature.use is not None:
            used = _probed(path, feature.name, asked.size)
            row += (used["seconds"], used["ms"], len(used["kernels"]))
        rows.append(row + (None,) * (6 - len(row)))
    print_rows(
        f"Of features that it does without ({plain['ms']:.0f} ms, the first "
        f"{plain['seconds']:.1f} s), and their first use",
        ("feature", "modules loaded", "functions compiled", "first, s", "then, ms", "functions"),
        rows,
    )


def _probed(path: Path, feature: str, size: int) -> dict[str, Any]:
    module = [sys.executable, "-m", "tests.benchmarks.absent", "--probe"]
    with tempfile.TemporaryDirectory() as cache:
        place = {"XDG_CACHE_HOME": cache, "LOCALAPPDATA": cache, "OMP_WAIT_POLICY": "PASSIVE"}
        done = subprocess.run(
            [*module, feature, str(path.absolute()), str(size)],
            cwd=ROOT,
            env={**os.environ, **place},
            capture_output=True,
            text=True,
            check=True,
        )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def probe(path: Path, feature: str, size: int) -> dict[str, Any]:
    """Draw the plain picture, then use a feature for the first time, or look at what is there."""
    brought = set(sys.modules)
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.scene.default_tf import default_transfer_function
    from model.scene.inputs import SceneInputs
    from model.scene.view import View
    from model.volume_files import read_volume

    volume = read_volume(path)
    inputs = SceneInputs.of(View(30.0, 20.0), default_transfer_function(volume))
    begun = time.perf_counter()
    renderer = RaycastRenderer(volume)
    draw: Draw = partial(renderer.render, inputs, size)
    draw()
    found: dict[str, Any] = {}
    if feature:
        brought, compiled = set(sys.modules), _kernels()
        use = next(each.use for each in FEATURES if each.name == feature)
        assert use is not None
        begun = time.perf_counter()
        draw = use(volume, inputs, renderer, size)
        draw()
    else:
        compiled = set()
    found["seconds"] = time.perf_counter() - begun
    found["modules"] = sorted(set(sys.modules) - brought)
    found["kernels"] = sorted(_kernels() - compiled)
    found["ms"] = 1e3 * statistics.median(_seconds(draw) for _ in range(REPEATS))
    if not feature:
        found["ratios"] = _neutral(renderer, volume, inputs, draw, size)
    return found


def _neutral(renderer: Any, volume: Any, inputs: Any, plain: Draw, size: int) -> dict[str, float]:
    """Time of pictures with inputs that change nothing, over that of the plain one."""
    import numpy as np

    from model.rendering.raster import Raster
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.scene.crop import CropBox
    from model.scene.light import LightDirection

    known = replace(volume, missing=np.zeros(volume.voxels.shape, dtype=bool))
    variants: dict[str, Draw] = {
        "crop": partial(renderer.render, replace(inputs, crop=CropBox()), size),
        "light's direction": partial(
            renderer.render, replace(inputs, light=LightDirection()), size
        ),
        "wide raster": partial(renderer.render, inputs, Raster(size, size)),
        "scalar range": partial(
            RaycastRenderer(volume.over(volume.data_range)).render, inputs, size
        ),
        "missing voxels": partial(RaycastRenderer(known).render, inputs, size),
    }
    ratios = {}
    for name, draw in variants.items():
        draw()
        # One after the other: what else the machine does falls on both.
        pairs = [(_seconds(plain), _seconds(draw)) for _ in range(REPEATS)]
        ratios[name] = statistics.median(varied / alone for alone, varied in pairs)
    return ratios


def _seconds(draw: Draw) -> float:
    begun = time.perf_counter()
    draw()
    return time.perf_counter() - begun


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
