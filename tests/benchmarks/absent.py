"""What features cost in a picture that does without them.

With `--probe` it is one picture in a process of its own, which has compiled nothing before, and
has loaded nothing but the standard library.
"""

import json
import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median

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


def main(arguments=None):
    """Measure in a process of its own."""
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["--probe"]:
        print(json.dumps(probe(Path(words[1]), int(words[2]))))
        return
    from tests.benchmarks.rows import options, parsed, paths, print_rows, probed

    asked = parsed(options(__doc__, size=256), words)
    with tempfile.TemporaryDirectory() as cache:
        place = {"XDG_CACHE_HOME": cache, "LOCALAPPDATA": cache, "OMP_WAIT_POLICY": "PASSIVE"}
        found = probed("absent", paths(asked)[0].absolute(), asked.size, **place)
    title = f"A plain picture of {asked.size} x {asked.size}, with an input that changes nothing"
    print_rows(title, ("input", "time over the plain one's"), found["ratios"].items())
    rows = []
    for feature, own in FEATURES.items():
        # The ray caster's own are always loaded: of these only compiled functions count.
        modules = tuple(name for name in own if not name.startswith(f"{RAYCAST}."))
        loaded = sum(_is_of(name, modules) for name in found["modules"])
        rows.append((feature, loaded, sum(_is_of(name, own) for name in found["kernels"])))
    heading = ("feature", "modules loaded", "functions compiled")
    print_rows(f"Of features that it does without ({found['ms']:.0f} ms)", heading, rows)


def _is_of(name, prefixes):
    return any(name == each or name.startswith((f"{each}:", f"{each}.")) for each in prefixes)


def probe(path, size):
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
    found = {"modules": list(set(sys.modules) - brought), "kernels": list(_kernels())}
    import numpy as np

    from model.rendering.raster import Raster
    from model.scene.crop import CropBox
    from model.scene.scene import LightDirection
    from tests.benchmarks.rows import in_turn

    cropped, lit = replace(inputs, crop=CropBox()), replace(inputs, light=LightDirection())
    ranged = RaycastRenderer(volume.over(volume.data_range)).render
    known = replace(volume, missing=np.zeros(volume.voxels.shape, dtype=bool))
    hiding, render = RaycastRenderer(known).render, plain.func
    ways = {
        "none": lambda _: plain(),
        "crop": lambda _: render(cropped, size),
        "light's direction": lambda _: render(lit, size),
        "wide raster": lambda _: render(inputs, Raster(size, size)),
        "scalar range": lambda _: ranged(inputs, size),
        "missing voxels": lambda _: hiding(inputs, size),
    }
    times = [{name: s for name, (_, s) in each.items()} for each in in_turn(ways, range(REPEATS))]
    found["ms"] = 1e3 * median(each["none"] for each in times)
    found["ratios"] = {name: median(each[name] / each["none"] for each in times) for name in ways}
    return found


def _kernels():
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
