"""The ray caster's kernel that draws images, on CPU threads."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.compilation import compiled
from model.rendering.raycast.batch import BATCH, stack_batch, stack_pixel
from model.rendering.raycast.compositing import GROUP
from model.rendering.raycast.marching import march, show
from model.rendering.raycast.rays import make_ray


@compiled
def draw_rows(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    alphas: Any,
    colors: Any,
    light: Any,
    glow: Any,
    opaque: Any,
    camera: Any,
    step: float,
    rows: Any,
    image: Any,
    depth: Any,
    close: bool,
) -> None:
    """Draw some rows of an image; see :func:`model.rendering.raycast.marching.march`.

    Parameters
    ----------
    step : float
        World distance between samples.
    rows : tuple of int
        First row, and the row after the last.
    image : ndarray of float32, shape (rows, columns, 4)
        Output: RGBA.
    depth : ndarray of float32, shape (rows, columns)
        Output: world distance from the eye to the first visible sample, infinite if there is
        none; empty where nobody asks for it.
    close : bool
        Whether samples are close, see :func:`model.rendering.raycast.batch.fetch`.
    """
    size = image.shape[1]
    levels, staging = stack_batch(voxels, GROUP * BATCH if close else BATCH)
    total, piece = stack_pixel(), stack_pixel()
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, distance = make_ray(camera, step, column, row, size)
            first = march(
                voxels, shape, scale, missing, cells, cell_shape, shift, alphas, colors,
                light, glow, ray, opaque, levels, staging, total, piece,
            )  # fmt: skip
            visible = distance + min(first, ray.last) * step if first >= 0 else np.inf
            show(image, depth, row, column, total, visible)
