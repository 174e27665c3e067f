"""Several pictures as one: rows and columns with gaps between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

GAP = 4
"""Pixels between pictures."""

EMPTY = 0.12
"""Grey of gaps and of pictures that are missing."""


def mosaic(images: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return images (rows, columns, H, W, 3) in [0, 1] as one; images of NaN are left empty.

    Returns
    -------
    ndarray of float32, shape (rows (H + GAP) - GAP, columns (W + GAP) - GAP, 3)
    """
    rows, columns, height, width, _ = images.shape
    whole = (rows * (height + GAP) - GAP, columns * (width + GAP) - GAP, 3)
    picture = np.full(whole, EMPTY, dtype=np.float32)
    for row, column in np.ndindex(rows, columns):
        y, x = row * (height + GAP), column * (width + GAP)
        image = images[row, column]
        if not np.isnan(image).any():
            picture[y : y + height, x : x + width] = image
    return picture
