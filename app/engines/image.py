"""An image as far as an engine has drawn it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Image:
    """An image that better ones of the same scene follow, unless it is the last.

    Attributes
    ----------
    rgba : ndarray of float32, shape (H, W, 4)
        In [0, 1], premultiplied, row 0 at the top.
    seconds : float
        Time that it took.
    by : str
        Who has drawn it, for display.
    is_last : bool
        Whether it is all that was asked for.
    by_raycast : bool
        Whether the ray caster has drawn it.
    stands_in : bool
        Whether the last one at rest is drawn otherwise: by another renderer, or with more samples
        along rays.
    samples : int
        Of each pixel in path-traced light; 1 in other light.
    error : float or None
        How far it is estimated to be from the exact one, root mean square of the colours, infinite
        as long as that is not known; None if it is not estimated.
    """

    rgba: NDArray[np.float32]
    seconds: float
    by: str = ""
    is_last: bool = True
    by_raycast: bool = False
    stands_in: bool = False
    samples: int = 1
    error: float | None = None

    @property
    def width(self) -> int:
        """Pixels from left to right."""
        return int(self.rgba.shape[1])
