"""Pictures with more or fewer pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import middle_square


def resized(image: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Interpolate an image (h, w, channels) linearly to other rows and columns."""
    for axis, want in enumerate(shape):
        have = image.shape[axis]
        if have == want:
            continue
        last = have - 1
        at = np.clip((np.arange(want) + 0.5) * have / want - 0.5, 0, last)
        before = np.minimum(at.astype(np.intp), max(last - 1, 0))
        part = (at - before).astype(np.float32)
        part = part.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        after = np.minimum(before + 1, last)
        image = np.take(image, before, axis) * (1 - part) + np.take(image, after, axis) * part
    return image


def at_size_of(
    field: NDArray[np.float32], image: NDArray[np.float32], sampled: bool = False
) -> NDArray[np.float32]:
    """Return an image with as many pixels as a field of it, which may be of its square only.

    Parameters
    ----------
    field, image : ndarray of float32, shapes (H, W, 3)
    sampled : bool
        Whether pixels are what the image shows in their middle, as if it were rendered with as
        few, instead of means over their areas.
    """
    if field.shape == image.shape:
        return image
    # Imported here: the window starts without it.
    from skimage.transform import resize

    rows, columns, _ = field.shape
    shown = middle_square(image) if rows == columns else image
    order = 3 if sampled else 1
    resized = resize(shown, field.shape, order=order, anti_aliasing=not sampled)
    return np.asarray(resized, dtype=np.float32)
