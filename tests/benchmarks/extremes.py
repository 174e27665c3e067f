"""Largest errors at the extremes of what tfscope takes, against plain NumPy in 64 bits."""

import argparse
import math
from contextlib import closing
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from app.cli.console import console, counting
from model.errors import TfscopeError
from model.rendering.path_tracing.renderer import Lamp, PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.scene.transfer_function import TF_SAMPLES, ColorTF
from tests import reference_light
from tests.benchmarks.extreme_scenes import extremes, refused
from tests.benchmarks.rows import parsed, print_rows

DISTANCE = 0.5
"""Sample distance in voxels."""

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
            posed = pose()
            for columns, table in zip(TABLES, tables, strict=True):
                table.append((*names, *(_found(way, posed) for way in columns.values())))
            show(number)
    tables.append([("input", "what is said"), *refused().items()])
    for heading, *rows in tables:
        print_rows("", heading, rows)
    if asked.out is not None:
        write_tables(asked.out, tables)
        console.print(f"{asked.out}")


def write_tables(page, tables):
    """Replace a page's tables, one after the other."""
    before, *parts = page.read_text(encoding="utf-8").split(HERE[0])
    text = before
    for part, (heading, *rows) in zip(parts, tables, strict=True):
        lines = ["| " + " | ".join(row) + " |" for row in (heading, ["---"] * len(heading), *rows)]
        text += "\n".join((HERE[0], *lines, HERE[1])) + part.split(HERE[1], 1)[1]
    page.write_text(text, encoding="utf-8")


def _found(measure, posed):
    """An error in few characters, or why there is none."""
    try:
        found = measure(posed)
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


def _drawn(posed, name, lighting):
    with closing(open_renderer(name, posed.volume, lighting)) as renderer:
        return renderer.render(posed.inputs, posed.raster)


def _truth(posed, lighting):
    return reference_light.picture(posed.volume, posed.inputs, posed.raster, DISTANCE, lighting)


def picture(lighting, name="raycast"):
    """The measurement of a renderer's pictures; the ray caster's error is relative."""
    return lambda posed: _error(
        _drawn(posed, name, lighting), _truth(posed, lighting), relative=name == "raycast"
    )


def _path_opacity(posed):
    """Error of the opacity under the usual light; NaN where a colour is not finite, or black."""
    image = _drawn(posed, "raycast", "path")
    if image[..., 3].max() > 0.01 and not image[..., :3].max() > 0:
        return float("nan")
    opacity = _error(image[..., 3], _truth(posed, "none")[..., 3], relative=False)
    return opacity if np.isfinite(image).all() else float("nan")


def _white_furnace(posed):
    """Distance of a white medium's colour from its opacity under an even sky, which it equals."""
    lamp = Lamp(key=0.0, sky=1.0, surfaces=False, bounces=100_000)
    lowest = posed.volume.scalar_range[0]
    white = ColorTF(posed.volume.scalar_range, ((lowest, 1.0, 1.0, 1.0),))
    with closing(PathTracer(posed.volume, lamp=lamp)) as tracer:
        image = tracer.render(replace(posed.inputs, color_tf=white), posed.raster, samples=2)
    return _error(image[..., :3], np.repeat(image[..., 3:], 3, axis=-1), relative=False)


@lru_cache(maxsize=16)
def _derivative(posed, lighting, number):
    given = posed.volume, posed.inputs, posed.raster, DISTANCE, lighting
    return reference_light.derivative(*given, EDITS[number])


def _plot(lighting):
    """Error of the derivative of the picture's squared norm along some edits."""

    def measure(posed):
        rows, columns = posed.raster.shape
        window = np.array([[0, rows, 0, columns]])
        with closing(RaycastRenderer(posed.volume, lighting)) as renderer:
            gradients, _ = renderer.differentiate(posed.inputs, posed.raster, window)
        found, truth = [], []
        for number, edit in enumerate(EDITS):
            image, change = _derivative(posed, lighting, number)
            found.append(float(gradients[0] @ edit))
            truth.append(float((image[..., :3] * change[..., :3]).sum()))
        return _error(np.array(found), np.array(truth), relative=True)

    return measure


def _field(lighting):
    """Error of each pixel's derivative along some edits, the largest of them all."""

    def measure(posed):
        with closing(RaycastRenderer(posed.volume, lighting)) as renderer:
            found = [renderer.change(posed.inputs, posed.raster, edit) for edit in EDITS]
        truth = [_derivative(posed, lighting, number)[1][..., :3] for number in range(len(EDITS))]
        return _error(np.array(found), np.array(truth), relative=True)

    return measure


LIGHTS = {"unlit": "none", "direct": "direct", "soft": "soft"}

TABLES = (
    {
        **{name: picture(light) for name, light in LIGHTS.items()},
        "VTK unlit": picture("none", "vtk"),
        "VTK direct": picture("direct", "vtk"),
        "path-traced opacity": _path_opacity,
        "path-traced light": _white_furnace,
    },
    {f"plot, {name}": _plot(light) for name, light in LIGHTS.items()}
    | {f"field, {name}": _field(light) for name, light in LIGHTS.items()},
)
"""Columns of the tables of pictures and of sensitivities."""


if __name__ == "__main__":
    main()
