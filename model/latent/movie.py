"""Frames of movies: images with their transfer functions (TFs) below."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.rendering.brightness import brighten
from model.scene.transfer_function import ColorTF, OpacityTF

STRIP_SHARE = 0.18
"""Height of the TF's plot, as a fraction of the image's."""

_BACKGROUND, _LINE = 0.1, 0.9


def movie_frame(
    image: NDArray[np.float32], tf: OpacityTF, colors: ColorTF, brightness: float = 1.0
) -> NDArray[np.uint8]:
    """Image (S, S, 4) on black, with a plot of its TF below: uint8 (H, S, 3), H and S even."""
    size = image.shape[1] // 2 * 2
    height = max(int(STRIP_SHARE * size) // 2 * 2, 8)
    opacity = tf.sample(count=size)
    shades = colors.sample(tf.scalar_range, size)
    level = (1 - opacity) * (height - 2)
    rows = np.arange(height)[:, None]
    strip = np.full((height, size, 3), _BACKGROUND)
    below = rows >= level
    strip[below] = np.broadcast_to(shades, strip.shape)[below]
    # The line has no gaps where the TF is steep.
    before = np.concatenate([level[:1], level[:-1]])
    on_line = (rows >= np.floor(np.minimum(level, before))) & (
        rows <= np.ceil(np.maximum(level, before))
    )
    strip[on_line] = _LINE
    picture = np.clip(np.nan_to_num(image[:size, :size, :3]), 0, 1)
    brighten(picture, brightness)
    return np.rint(255 * np.concatenate([picture, strip])).astype(np.uint8)
