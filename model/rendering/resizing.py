"""Pictures with more or fewer pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


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
