"""Brightness of rendered images: a display curve, applied after all that is computed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.scene.scene import Lighting

LIT_BRIGHTNESS = 2.0
"""Usual brightness of lit images, which are dim: in ten of them (five volumes in direct and soft
light), 95 % of the pixels are darker than .45 to .70 of full brightness."""


def usual_brightness(lighting: Lighting) -> float:
    """Return the brightness that images are shown with unless another one is chosen."""
    return 1.0 if lighting == "none" else LIT_BRIGHTNESS


def brighten(colors: NDArray[np.float32], brightness: float) -> None:
    """Make colours (..., 3) in [0, 1] brighter or darker in place, dark ones by more.

    For a brightness b, a colour whose largest component is m is multiplied by b / (1 + (b - 1) m).
    Black, full brightness and hues do not change. Bright surfaces keep their shading; a constant
    factor would saturate them.
    """
    if brightness == 1:
        return
    red, green, blue = (colors[..., channel] for channel in range(3))
    largest = np.maximum(np.maximum(red, green), blue)
    largest *= np.float32(brightness - 1)
    largest += 1
    np.divide(np.float32(brightness), largest, out=largest)
    # Channel by channel: NumPy is slow along an axis of three numbers.
    for channel in (red, green, blue):
        channel *= largest
