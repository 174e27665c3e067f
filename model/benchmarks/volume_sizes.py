"""Cost of an image over the size of the volume: ray caster and VTK, side by side.

A volume of any size is a real one, enlarged or averaged by linear interpolation: its
structures are as many, and as opaque along a ray, as in the real one.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import zoom

from model.rendering.renderer import open_renderer
from model.rendering.scalars import unit_planes
from model.samples.sampling import draw_sample
from model.scene.scene import Lighting, Scene
from model.scene.volume import Volume

LIGHTINGS: tuple[Lighting, ...] = ("none", "direct", "soft", "shadows")


@dataclass(frozen=True)
class CostRow:
    """Time of an image.

    Attributes
    ----------
    edge : int
        Voxels along the volume's longest axis.
    lighting : {"none", "direct", "soft", "shadows"}
    seconds : dict of float
        Mean time of an image by "raycast" and "vtk".
    """

    edge: int
    voxels: int
    lighting: Lighting
    seconds: dict[str, float]


def of_size(volume: Volume, edge: int) -> Volume:
    """Enlarge or shrink a volume to a number of voxels along its longest axis, in bytes."""
    factor = edge / max(volume.dimensions)
    unit = np.stack([plane.astype(np.float32) for plane in unit_planes(volume)])
    scalars = zoom(unit, factor, order=1, grid_mode=True, mode="nearest")
    ratios = ((n - 1) / (m - 1) for n, m in zip(unit.shape[::-1], scalars.shape[::-1], strict=True))
    sx, sy, sz = (s * r for s, r in zip(volume.spacing, ratios, strict=True))
    return Volume(np.rint(255 * scalars).astype(np.uint8), (sx, sy, sz), name=volume.name)


def costs_over_sizes(
    volume: Volume,
    edges: tuple[int, ...],
    size: int,
    count: int,
    slowest: float,
    seed: int = 0,
) -> Iterator[CostRow]:
    """Time images of both renderers.

    Parameters
    ----------
    edges : tuple of int
        Voxels along the longest axis, in increasing order.
    size : int
        Width and height of the images in pixels.
    count : int
        Views and TFs per measurement, each with a light that was not there before.
    slowest : float
        Seconds for an image after which a renderer is left out for larger volumes.

    Yields
    ------
    CostRow
    """
    given_up: set[tuple[str, Lighting]] = set()
    for edge in edges:
        enlarged = of_size(volume, edge)
        for lighting in LIGHTINGS:
            scene = Scene.of(enlarged, size, lighting, renderer="raycast")
            samples = [draw_sample(scene, seed, "holdout", index) for index in range(count + 1)]
            seconds = {}
            for name in ("raycast", "vtk"):
                if (name, lighting) in {*given_up, ("vtk", "soft")}:
                    continue
                renderer = open_renderer(
                    name, enlarged, scene.lighting, scene.light, scene.sample_distance
                )
                # The first image takes compilation and preparation.
                renderer.render(samples[0], size)
                start = time.perf_counter()
                for sample in samples[1:]:
                    renderer.render(sample, size)
                seconds[name] = (time.perf_counter() - start) / count
                renderer.close()
                if seconds[name] > slowest:
                    given_up.add((name, lighting))
            yield CostRow(edge, enlarged.scalars.size, lighting, seconds)
