"""Largest errors at the extremes of what tfscope takes, against plain NumPy in 64 bits."""

import argparse
import math
from contextlib import closing
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from app.cli.console import console, counting
from model.errors import TfscopeError
from model.rendering.path_tracing.renderer import Lamp, PathTracer
from model.rendering.raster import Raster, blur_of
from model.rendering.raycast.illumination import node_distance
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.scene.crop import LEAST_LENGTH, CropBox
from model.scene.filling import fill
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from tests import reference_light
from tests.benchmarks.rows import parsed, print_rows

DISTANCE = 0.5  # sample distance in voxels

_BINS = np.arange(TF_SAMPLES)
EDITS = (
    *(np.asarray(place == _BINS, float) for place in (40, 128)),
    *(np.exp(-0.5 * ((_BINS - place) / width) ** 2) for place, width in ((128, 20), (220, 12))),
)
"""Edits of TFs: two single bins, and two bells."""

HERE = ("<!-- by tests.benchmarks.extremes -->", "<!-- end -->")
"""What stands around each of the page's tables."""


def main(arguments=None):
    """Measure all extremes; print tables, and write them into the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="page whose tables are replaced")
    parser.add_argument("--kind", action="append", help="of extremes; may be repeated")
    asked = parsed(parser, arguments)
    chosen = {k: v for k, v in extremes().items() if asked.kind is None or k[0] in asked.kind}
    tables = [[("", "", *columns)] for columns in TABLES]
    with counting("extremes", len(chosen)) as show:
        for number, (names, pose) in enumerate(chosen.items(), 1):
            scene = pose()
            place = scene.inputs.view, scene.volume, scene.raster
            reference_light.BLUR = blur_of(*place)
            reference_light.NODE_BLUR = blur_of(*place, node_distance(scene.volume)) / 2
            for columns, table in zip(TABLES, tables, strict=True):
                table.append((*names, *(_found(way, scene) for way in columns.values())))
            show(number)
    for heading, *rows in tables:
        print_rows("", heading, rows)
    if asked.out is not None:
        write_tables(asked.out, tables)
        console.print(f"{asked.out}")


def write_tables(page, tables):
    """Replace a page's tables, one after the other."""
    text, *parts = page.read_text(encoding="utf-8").split(HERE[0])
    for part, (heading, *rows) in zip(parts, tables, strict=True):
        lines = ["| " + " | ".join(row) + " |" for row in (heading, ["---"] * len(heading), *rows)]
        text += "\n".join((HERE[0], *lines, HERE[1])) + part.split(HERE[1], 1)[1]
    page.write_text(text, encoding="utf-8")


def _found(measure, scene):
    """An error in few characters, or why there is none."""
    try:
        found = measure(scene)
    except TfscopeError as error:
        return str(error)
    if not math.isfinite(found):
        return "not finite"
    if found == 0:
        return "0"
    if found < 1e-4:
        return f"{found:.0e}".replace("e-0", "e-")
    return f"{found:.4f}".lstrip("0") if found < 0.001 else f"{found:.3f}".lstrip("0")


def _error(found, truth, relative):
    """Largest difference, as a share of the largest number of the truth if relative; or NaN."""
    if not (np.isfinite(found).all() and np.isfinite(truth).all()):
        return float("nan")
    largest = float(np.abs(found - truth).max())
    scale = float(np.abs(truth).max()) if relative else 1.0
    return largest / scale if scale > 0 else largest


def _drawn(scene, name, lighting):
    with closing(open_renderer(name, scene.volume, lighting)) as renderer:
        return renderer.render(scene.inputs, scene.raster)


def _truth(scene, lighting):
    return reference_light.picture(*scene.given, DISTANCE, lighting)


def picture(lighting, scene, name="raycast"):
    """Error of a renderer's picture; the ray caster's is relative."""
    found, truth = _drawn(scene, name, lighting), _truth(scene, lighting)
    return _error(found, truth, relative=name == "raycast")


def _path_opacity(scene):
    """Error of the opacity under the usual light; NaN where a colour is not finite, or black."""
    image = _drawn(scene, "raycast", "path")
    if image[..., 3].max() > 0.01 and not image[..., :3].max() > 0:
        return float("nan")
    opacity = _error(image[..., 3], _truth(scene, "none")[..., 3], relative=False)
    return opacity if np.isfinite(image).all() else float("nan")


def _white_furnace(scene):
    """Distance of a white medium's colour from its opacity under an even sky, which it equals."""
    lamp = Lamp(key=0.0, sky=1.0, surfaces=False, bounces=100_000)
    lowest = scene.volume.scalar_range[0]
    white = ColorTF(scene.volume.scalar_range, ((lowest, 1.0, 1.0, 1.0),))
    with closing(PathTracer(scene.volume, lamp=lamp)) as tracer:
        image = tracer.render(replace(scene.inputs, color_tf=white), scene.raster, samples=2)
    return _error(image[..., :3], np.repeat(image[..., 3:], 3, axis=-1), relative=False)


@lru_cache(maxsize=16)
def _derivative(scene, lighting, number):
    return reference_light.derivative(*scene.given, DISTANCE, lighting, EDITS[number])


def _plot(lighting, scene):
    """Error of the derivative of the picture's squared norm along some edits."""
    rows, columns = scene.raster.shape
    window = np.array([[0, rows, 0, columns]])
    with closing(RaycastRenderer(scene.volume, lighting)) as renderer:
        gradients, _ = renderer.differentiate(scene.inputs, scene.raster, window)
    truths = [_derivative(scene, lighting, number) for number in range(len(EDITS))]
    truth = [(image[..., :3] * change[..., :3]).sum() for image, change in truths]
    return _error(np.array([gradients[0] @ edit for edit in EDITS]), np.array(truth), relative=True)


def _field(lighting, scene):
    """Error of each pixel's derivative along some edits, the largest of them all."""
    with closing(RaycastRenderer(scene.volume, lighting)) as renderer:
        found = [renderer.change(scene.inputs, scene.raster, edit) for edit in EDITS]
    truth = [_derivative(scene, lighting, number)[1][..., :3] for number in range(len(EDITS))]
    return _error(np.array(found), np.array(truth), relative=True)


LIGHTS = {"unlit": "none", "direct": "direct", "soft": "soft"}

TABLES = (
    {
        **{name: partial(picture, light) for name, light in LIGHTS.items()},
        "VTK unlit": partial(picture, "none", name="vtk"),
        "VTK direct": partial(picture, "direct", name="vtk"),
        "path-traced opacity": _path_opacity,
        "path-traced light": _white_furnace,
    },
    {f"plot, {name}": partial(_plot, light) for name, light in LIGHTS.items()}
    | {f"field, {name}": partial(_field, light) for name, light in LIGHTS.items()},
)
"""Columns of the tables of pictures and of sensitivities."""


SHAPE = (14, 20, 17)  # voxels of the volumes along z, y and x
SIZE = 24  # width and height of the pictures in pixels, where nothing else is said

VIEW = View(30.0, 20.0, 5.0, 0.8)

CURVE = ((0.0, 0.0), (0.3, 0.0), (0.6, 0.4), (0.9, 0.1), (1.0, 0.8))
"""Opacities over fractions of the scalar range."""

STOPS = ((0.0, 0.9, 0.2, 0.1), (0.5, 0.2, 0.9, 0.4), (1.0, 0.3, 0.5, 1.0))


@dataclass(frozen=True, eq=False)
class Posed:
    """A volume, inputs and pixels: all that a picture is drawn from."""

    volume: Volume
    inputs: SceneInputs
    raster: Raster

    @property
    def given(self):
        return self.volume, self.inputs, self.raster


def posed(volume=None, curve=CURVE, view=VIEW, light=None, crop=None, raster=None):
    """A scene with the curve stretched to the range of the volume that a call makes."""
    volume = Volume(field()) if volume is None else volume()
    lo, hi = volume.scalar_range

    def at(share):
        return lo * (1 - share) + hi * share

    opacity = OpacityTF((lo, hi), points=tuple((at(place), value) for place, value in curve))
    color = ColorTF((lo, hi), tuple((at(place), r, g, b) for place, r, g, b in STOPS))
    inputs = SceneInputs(view, opacity, color, light, crop)
    return Posed(volume, inputs, raster or Raster(SIZE, SIZE))


def field(shape=SHAPE, dtype=np.float32):
    """Smooth random voxels from 0 to 1, with pieces of either."""
    rough = np.random.default_rng(0).normal(size=shape)
    smooth = gaussian_filter(rough, [min(2.0, n / 7) for n in shape])
    smooth = (smooth - smooth.min()) / (smooth.max() - smooth.min())
    return np.asarray(np.clip(1.4 * smooth - 0.2, 0, 1), dtype=dtype)


def extremes():
    """Calls that make the scenes, by their kind and name, the ordinary one first."""
    kinds = {
        "ordinary": {"no extreme": {}},
        "opacity": {name: {"curve": curve} for name, curve in _curves().items()},
        "values": {name: {"volume": make} for name, make in _values().items()},
        "grid": _grids(),
        "view": _views(),
        "raster": {name: {"raster": Raster(*pixels)} for name, pixels in _RASTERS.items()},
        "part": _parts(),
    }
    return {
        (kind, name): partial(posed, **given)
        for kind, scenes in kinds.items()
        for name, given in scenes.items()
    }


def _curves():
    def single(place):
        around = {place - 1: 0.0, place: 1.0, place + 1: 0.0}
        return tuple((bin_ / 255, value) for bin_, value in around.items() if 0 <= bin_ <= 255)

    def everywhere(**named):
        return {f"{name} everywhere": ((0.0, value),) for name, value in named.items()}

    return {
        **everywhere(**{"0": 0.0, "1e-12": 1e-12, "1e-7": 1e-7, "1e-3": 1e-3}),
        "0 to 1e-6, a ramp": ((0.0, 0.0), (1.0, 1e-6)),
        **everywhere(**{"1 - 1e-7": 1 - 1e-7, "1": 1.0}),
        "1 from the middle on": ((0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (1.0, 1.0)),
        "1 in the lowest bin": single(0),
        "1 in a middle bin": single(128),
        "1 in the highest bin": single(255),
    }


def _values():
    precise = field(dtype=np.float64)
    half = precise - 0.5

    def scaled(width, bits):
        dtype = np.dtype(f"float{bits}")
        return lambda: Volume(dtype.type(width) * field(dtype=dtype))

    widths = {64: (1e-300, 1e-30, 1e-12, 1e12, 1e30, 1e300), 32: (1e-30, 1e-12, 1e12, 1e30)}
    return {
        **{f"0 to {n:g}, float{bits}": scaled(n, bits) for bits in widths for n in widths[bits]},
        "-8e307 to 8e307": lambda: Volume(1.6e308 * half),
        "1e6 and 1e-3 more, float64": lambda: Volume(1e6 + 1e-3 * precise),
        "1e15 and 1e3 more, float64": lambda: Volume(1e15 + 1e3 * precise),
        "int64, all of it": lambda: Volume((half * 1.8e19).astype(np.int64)),
        "two whole numbers": lambda: Volume((precise > 0.5).astype(np.uint8)),
    }


def _grids():
    # A needle is narrower than a pixel from where all of it is in view.
    near = replace(VIEW, distance=0.01)

    def grid(view=VIEW, shape=SHAPE, **given):
        return {"volume": lambda: Volume(field(shape), **given), "view": view}

    return {
        "1 : 1,000 along x": grid(near, spacing=(1e3, 1.0, 1.0)),
        "1 : 1,000 along z": grid(near, spacing=(1.0, 1.0, 1e3)),
        "1,000 : 1 along z": grid(spacing=(1.0, 1.0, 1e-3)),
        "voxels of 1e-12": grid(spacing=(1e-12, 1e-12, 1e-12)),
        "voxels of 1e12": grid(spacing=(1e12, 1e12, 1e12)),
        "two voxels thick": grid(shape=(2, 20, 17)),
        "2 x 2 x 2 voxels": grid(shape=(2, 2, 2)),
        "1,000 x 2 x 2 voxels": grid(near, (2, 2, 1000)),
        "origin 1e12 away": grid(origin=(1e12, -1e12, 1e12)),
    }


def _views():
    far = replace(VIEW, distance=1e3)
    return {
        "camera inside": {"view": replace(VIEW, distance=0.05)},
        "camera 1e-9 from the centre": {"view": replace(VIEW, distance=1e-9)},
        # An odd number of pixels, so that one of them meets the volume.
        "camera 1,000 times as far": {"view": far, "raster": Raster(25, 25)},
        "along an axis": {"view": View()},
        "from the pole": {"view": View(0.0, 90.0, 0.0, 0.7)},
        "panned out of view": {"view": replace(VIEW, pan_x=1e6)},
        "light along the view": {"light": LightDirection(0.0, 0.0)},
        "light against the view": {"light": LightDirection(180.0, 0.0)},
        "light from straight above": {"light": LightDirection(0.0, 90.0)},
        "light along an axis": {"light": LightDirection(90.0, 0.0), "view": View()},
    }


_RASTERS = {
    "1 x 1": (1, 1),
    "3 x 2": (3, 2),
    "16,384 x 1": (16384, 1),
    "1 x 16,384": (1, 16384),
    "a row of 16,384 x 16,384": (16384, 16384, 0, 8000, 16384, 1),
    "a pixel of 16,384 x 16,384": (16384, 16384, 9000, 8000, 1, 1),
}


def _parts():
    def without(where):
        # As readers do, whatever the file has there.
        voxels = np.where(where, field()[~where].min(), field()).astype(np.float32)
        return {"volume": lambda: Volume(fill(voxels, where), missing=where)}

    thin, near = 0.5 + LEAST_LENGTH, replace(VIEW, distance=0.02)
    two = np.ones(SHAPE, dtype=bool)
    two[7, 10, 8] = two[7, 10, 9] = False
    cube = CropBox((0.5, 0.5, 0.5), (thin, thin, thin))
    return {
        "thinnest crop": {"crop": CropBox((0.5, 0.0, 0.0), (thin, 1.0, 1.0))},
        "thinnest crop along all axes": {"crop": cube, "view": near},
        "half of the voxels missing": without(np.random.default_rng(1).random(SHAPE) < 0.5),
        "all but two voxels missing": without(two),
    }


if __name__ == "__main__":
    main()
