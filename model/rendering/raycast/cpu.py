"""The ray caster's kernels for CPU threads."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.compilation import compiled
from model.rendering.raycast.batch import stack_batch, stack_scratch
from model.rendering.raycast.marching import march, show
from model.rendering.raycast.preintegration import march_segments
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
    shadows: Any,
    opaque: Any,
    camera: Any,
    step: float,
    rows: Any,
    image: Any,
    depth: Any,
    close: Any = None,
) -> None:
    """Draw some rows of an image; see :func:`model.rendering.raycast.marching.march`.

    Parameters
    ----------
    step : float
        World distance between samples.
    rows : tuple of int
        First row, and the row after the last.
    image : ndarray of float32, shape (rows, columns, channels)
        Output: RGBA, or opacity only.
    depth : ndarray of float32, shape (size, size), or None
        Output: world distance from the eye to the first visible sample,
        infinite if there is none.
    close : bool, optional
        Given where samples are close, see :func:`model.rendering.raycast.batch.fetch`.
    """
    size = image.shape[1]
    levels, staging, total = stack_batch(voxels, close)
    scratch = stack_scratch()
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, distance = make_ray(camera, step, column, row, size)
            first = march(
                voxels, shape, scale, missing, cells, cell_shape, shift,
                alphas, colors, light, glow, shadows, ray, opaque,
                levels, staging, total, scratch, close,
            )  # fmt: skip
            visible = distance + min(first, ray.last) * step if first >= 0 else np.inf
            show(image, depth, row, column, total, visible)


@compiled
def draw_rows_preintegrated(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    integrals: Any,
    opaque: Any,
    camera: Any,
    step: float,
    rows: Any,
    image: Any,
    depth: Any,
) -> None:
    """Draw some rows of an image with pre-integrated classification; see :func:`draw_rows`."""
    size = image.shape[1]
    levels, staging, total = stack_batch(voxels)
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, distance = make_ray(camera, step, column, row, size)
            first = march_segments(
                voxels, shape, scale, missing, cells, cell_shape, shift,
                integrals, ray, opaque, levels, staging, total,
            )  # fmt: skip
            visible = distance + min(first, ray.last) * step if first >= 0 else np.inf
            show(image, depth, row, column, total, visible)
