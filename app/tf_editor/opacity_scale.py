"""The opacity plot's vertical axis: opacities at heights from 0 to 1, linear or logarithmic."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

BEND = 0.002
"""Opacity below which the logarithmic scale is almost linear, so that it has a 0."""

_TOP = math.asinh(1 / BEND)
_MARKED = {0.001: "", 0.01: ".01", 0.1: ".1"}
"""Labels of opacities between 0 and 1: that of the least would lie over the 0."""


@dataclass(frozen=True)
class OpacityScale:
    """Maps opacities to heights in the plot, and back.

    Attributes
    ----------
    logarithmic : bool
        Whether small opacities get as much room as large ones: an inverse hyperbolic sine.
    """

    logarithmic: bool = False

    def heights(self, opacities: ArrayLike) -> NDArray[np.float64]:
        """Return the heights of opacities of any shape, 0..1 for 0..1."""
        values = np.asarray(opacities, dtype=np.float64)
        return np.asarray(np.arcsinh(values / BEND) / _TOP) if self.logarithmic else values

    def height(self, opacity: float) -> float:
        """Return the height of an opacity."""
        return float(self.heights(opacity))

    def opacity(self, height: float) -> float:
        """Return the opacity at a height; outside 0..1, it is continued."""
        if not self.logarithmic:
            return height
        # Far above the plot, a hyperbolic sine would overflow.
        return BEND * math.sinh(min(max(height, -2.0), 2.0) * _TOP)

    def ticks(self) -> list[tuple[float, str]]:
        """Return heights and their labels."""
        if not self.logarithmic:
            return [(0, "0"), (0.5, ".5"), (1, "1")]
        between = [(self.height(opacity), text) for opacity, text in _MARKED.items()]
        return [(0, "0"), *between, (1, "1")]
