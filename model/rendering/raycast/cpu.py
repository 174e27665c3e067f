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
    medium: Any,
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
    """Draw some rows of an image; see :func:`model.rendering.raycast.marching.march`."""
    size = image.shape[1]
    levels, staging = stack_batch(medium.voxels, GROUP * BATCH if close else BATCH)
    total, piece = stack_pixel(), stack_pixel()
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, distance = make_ray(camera, step, column, row, size)
            first = march(medium, colors, light, glow, ray, opaque, levels, staging, total, piece)
            visible = distance + min(first, ray.last) * step if first >= 0 else np.inf
            show(image, depth, row, column, total, visible)
