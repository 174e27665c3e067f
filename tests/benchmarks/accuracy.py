"""Speed against accuracy: time and error of the ray caster's pictures, by step and by pixels."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from functools import partial
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from model.metrics import rmse
from model.rendering.raster import resized
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from tests.benchmarks.rows import options, print_machine, print_rows, scenes, timed, volumes

EXACT = 1 / 64
"""Sample distance of the pictures that errors are measured against, in voxels."""

SETTINGS = ((4.0, 4), (1.0, 2), (0.5, 2), (0.5, 1), (0.25, 1), (0.1, 1), (0.05, 1))
"""Sample distances in voxels, and pixels shown for each one drawn, along each side."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the same scenes at all settings, and exactly."""
    asked = options(__doc__, count=4, lighting="none").parse_args(arguments)
    print_machine()
    for volume in volumes(asked):
        inputs = scenes(volume, asked, asked.lighting)
        with closing(RaycastRenderer(volume, asked.lighting)) as renderer:
            renderer.render(inputs[0], asked.size, EXACT)
            exact = [timed(lambda s=s: renderer.render(s, asked.size, EXACT)) for s in inputs]
            rows = []
            for distance, coarser in SETTINGS:
                errors, seconds = [], []
                for scene, (truth, _) in zip(inputs, exact, strict=True):
                    image, taken = timed(
                        partial(_picture, renderer, scene, asked.size, distance, coarser)
                    )
                    errors.append(rmse(image[..., :3], truth[..., :3]))
                    seconds.append(taken)
                pixels = "all" if coarser == 1 else f"1/{coarser**2}"
                rows.append((distance, pixels, 1e3 * fmean(seconds), fmean(errors), max(errors)))
        rows.append((EXACT, "all", 1e3 * fmean(taken for _, taken in exact), 0.0, 0.0))
        title = f"{volume.name}, {asked.lighting}, {asked.size} x {asked.size}"
        print_rows(title, ("voxels", "pixels", "ms", "RMSE", "largest"), rows)


def _picture(
    renderer: RaycastRenderer, scene: SceneInputs, size: int, distance: float, coarser: int
) -> NDArray[np.float32]:
    image = renderer.render(scene, size // coarser, distance)
    return image if coarser == 1 else resized(image, (size, size))


if __name__ == "__main__":
    main()
