"""VTK and the ray caster: time and error of their pictures, by step and by share of the pixels."""

from collections import defaultdict
from contextlib import ExitStack, closing
from functools import partial
from statistics import fmean

from model.metrics import rmse
from model.rendering.raster import resized
from model.rendering.renderer import open_renderer
from model.scene.scene import Scene
from tests.benchmarks.rows import draw_scenes, in_turn, options, parsed, print_rows, volumes

VTK, EXACT = ("vtk", 0.5, 1), ("raycast", 1 / 64, 1)
BETWEEN = ((4.0, 4), (1.0, 2), (0.5, 2), (0.5, 1), (0.1, 1), (0.05, 1))
SETTINGS = (VTK, *(("raycast", *step) for step in BETWEEN), EXACT)
"""Sample distances in voxels, and pixels shown for each one drawn, along each side."""

HEADING = (
    *("renderer", "voxels", "pixels", "ms", "images/s", "RMSE to exact"),
    *("RMSE to VTK", "largest", "speed (VTK: 1)"),
)


def main(arguments=None):
    asked = parsed(options(__doc__, count=10, size=256, lighting="none"), arguments)
    for volume in volumes(asked):
        rows = compared(volume, asked)
        title = f"{volume.name}, {asked.lighting}, {asked.size} x {asked.size}"
        print_rows(title, HEADING[: len(rows[0])], rows)


def compared(volume, asked):
    """Draw the same scenes in all settings, with VTK where it has the light."""
    inputs = draw_scenes(Scene.of(volume, asked.size, asked.lighting), asked.count)
    settings = SETTINGS if asked.lighting in ("none", "direct") else SETTINGS[1:]
    truths = [setting for setting in (EXACT, VTK) if setting in settings]
    seconds, errors = defaultdict(list), defaultdict(list)
    with ExitStack() as opened:
        renderers = {
            name: opened.enter_context(closing(open_renderer(name, volume, asked.lighting)))
            for name, *_ in settings[:2]
        }
        ways = {
            (name, *o): partial(_drawn, renderers[name], asked.size, *o) for name, *o in settings
        }
        for found in in_turn(ways, inputs):
            for setting, (image, taken) in found.items():
                seconds[setting].append(taken)
                apart = [rmse(image[..., :3], found[truth][0][..., :3]) for truth in truths]
                errors[setting].append(apart)
    rows = []
    for setting in settings:
        mean, (exact, *vtk) = fmean(seconds[setting]), zip(*errors[setting], strict=True)
        pixels = "all" if setting[2] == 1 else f"1/{setting[2] ** 2}"
        row = [*setting[:2], pixels, 1e3 * mean, 1 / mean, fmean(exact)]
        for apart in vtk:
            row += [fmean(apart), max(apart), fmean(seconds[VTK]) / mean]
        rows.append(row)
    return rows


def _drawn(renderer, size, distance, coarser, scene):
    image = renderer.render(scene, size // coarser, distance)
    return image if coarser == 1 else resized(image, (size, size))


if __name__ == "__main__":
    main()
