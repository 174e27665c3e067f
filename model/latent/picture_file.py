"""Pictures in files, as goals of a search."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import LatentError

LARGEST = 256
"""Width and height from which a picture is reduced, as searches compare small ones."""


def read_picture(path: Path) -> NDArray[np.float32]:
    """Read a picture as float32 RGBA (S, S, 4) in [0, 1], premultiplied.

    A picture without an alpha channel counts as opaque where it is not black; one that is not
    square is cut to its middle, and a large one reduced by the means of its parts.

    Raises
    ------
    LatentError
        When the file is no picture.
    """
    import imageio.v3 as iio

    try:
        values = np.asarray(iio.imread(path, plugin="pillow"))
    except (OSError, ValueError, SyntaxError) as error:
        raise LatentError(f"{path}: the picture cannot be read ({error}).") from error
    if values.dtype.kind not in "u" or values.ndim not in (2, 3):
        raise LatentError(f"{path}: an array of shape {values.shape} is not a picture.")
    scaled = values.astype(np.float32) / np.iinfo(values.dtype).max
    if scaled.ndim == 2:
        scaled = np.repeat(scaled[..., None], 3, axis=2)
    if scaled.shape[2] == 2:
        scaled = np.concatenate([np.repeat(scaled[..., :1], 3, axis=2), scaled[..., 1:]], axis=2)
    if scaled.shape[2] == 3:
        alpha = scaled.max(axis=2, keepdims=True) > 0
        scaled = np.concatenate([scaled, alpha.astype(np.float32)], axis=2)
    else:
        scaled[..., :3] *= scaled[..., 3:]
    height, width = scaled.shape[:2]
    side = min(height, width)
    top, left = (height - side) // 2, (width - side) // 2
    step = max(side // LARGEST, 1)
    side -= side % step
    square = scaled[top : top + side, left : left + side]
    return square.reshape(side // step, step, side // step, step, 4).mean(axis=(1, 3))
