"""Pictures with more or fewer pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster


def enlarged(image: NDArray[np.float32], drawn: Raster, shown: Raster) -> NDArray[np.float32]:
    """Interpolate an image's pixels (h, w, channels) linearly to those shown, as a screen does."""
    places = (
        (drawn.top, drawn.height, shown.top, shown.rows, shown.height),
        (drawn.left, drawn.width, shown.left, shown.columns, shown.width),
    )
    for axis, (first, have, start, count, want) in enumerate(places):
        if have == want:
            continue
        last = image.shape[axis] - 1
        at = np.clip((np.arange(start, start + count) + 0.5) * have / want - 0.5 - first, 0, last)
        before = np.minimum(at.astype(np.intp), max(last - 1, 0))
        part = (at - before).astype(np.float32)
        part = part.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        after = np.minimum(before + 1, last)
        image = np.take(image, before, axis) * (1 - part) + np.take(image, after, axis) * part
    return image


def resized(image: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Interpolate a whole image (h, w, channels) linearly to other rows and columns."""
    (height, width), (rows, columns) = image.shape[:2], shape
    return enlarged(image, Raster(width, height), Raster(columns, rows))
