"""How smoothly the values of a headerless file follow one another under a scalar type.

Neighbouring voxels have similar values. Read with the right type and byte order, values that
lie one voxel, one row or one plane apart in the file therefore differ little; with a wrong
type, or at a wrong distance, they differ about as much as any two values.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

WINDOWS = 24
"""Parts of the file, evenly spread, that are compared with what lies behind them."""

WINDOW = 4096
"""Most values in a window."""

LARGEST_MAGNITUDES = 1e-12, 1e12
"""Magnitudes between which the largest values of measured or computed data lie."""

PERCENTILES = 0.5, 99.5


class Smoothness:
    """Differences between the values of a file at any distance, from samples of it.

    Parameters
    ----------
    path : Path
        A file of at least 8 values; it is mapped, not read.
    dtype : numpy.dtype
        With the byte order to try.
    offset : int
        Bytes to skip before the first value.

    Attributes
    ----------
    is_plausible : bool
        False for floating-point values of absurd magnitudes; such a reading has no smoothness.
    step : float
        Mean difference of successive values, in the data's units.
    """

    def __init__(self, path: Path, dtype: np.dtype[np.generic], offset: int = 0) -> None:
        count = (path.stat().st_size - offset) // dtype.itemsize
        self._values = np.asarray(np.memmap(path, dtype, "r", offset, (count,)))
        self._width = min(WINDOW, count // 4)
        # Enough digits to tell neighbouring values apart, at half the time where possible.
        narrow = dtype.itemsize < 4 or (dtype.kind == "f" and dtype.itemsize == 4)
        self._working = np.dtype(np.float32 if narrow else np.float64)
        self._starts = np.unique(np.linspace(0, count - self._width, WINDOWS).astype(np.int64))
        stored = np.stack([self._values[s : s + self._width] for s in self._starts])
        with np.errstate(invalid="ignore"):  # NaN
            windows = stored.astype(np.float64)
        self.is_plausible = dtype.kind != "f" or _is_plausible(windows)
        self._known: dict[int, float] = {}
        if not self.is_plausible:
            return
        windows[~np.isfinite(windows)] = 0.0
        self.step = float(np.abs(np.diff(windows, axis=1)).mean())
        lowest, highest = _extent(windows)
        self._offset, self._scale = lowest, 1.0 / max(highest - lowest, 1e-30)
        self._windows = self._scaled(stored)
        strangers = np.random.default_rng(0).permutation(self._windows.reshape(-1))
        apart = np.abs(strangers - self._windows.reshape(-1)).mean()
        self._apart = max(float(apart), 1e-12)

    def at(self, distance: int) -> float:
        """Return how much values at a distance in the file differ.

        Parameters
        ----------
        distance : int
            In values, from 1 to half of the file's.

        Returns
        -------
        float
            Mean difference relative to that of values from anywhere: about 1 for
            unrelated ones, and near 0 for neighbours in a smooth volume.
        """
        if distance not in self._known:
            self._known[distance] = self._measured(distance)
        return self._known[distance]

    def _measured(self, distance: int) -> float:
        others, own = [], []
        last = self._values.size - self._width
        for start, window in zip(self._starts, self._windows, strict=True):
            # Windows at the end of the file are compared with what lies before them.
            other = start + distance if start + distance <= last else start - distance
            if other >= 0:
                others.append(self._values[other : other + self._width])
                own.append(window)
        if not others:
            return 1.0
        differences = np.abs(self._scaled(np.stack(others)) - np.stack(own))
        return float(differences.mean()) / self._apart

    def _scaled(self, values: NDArray[np.generic]) -> NDArray[np.float32]:
        """Map values to 0..1, with outliers at the ends and NaN as the lowest."""
        with np.errstate(over="ignore", invalid="ignore"):
            unit: NDArray[np.floating] = values.astype(self._working)
            unit = (unit - self._offset) * self._scale
        return np.fmin(np.fmax(unit, 0.0), 1.0).astype(np.float32, copy=False)


def _is_plausible(windows: NDArray[np.float64]) -> bool:
    """Whether floating-point values have magnitudes that measured or computed data have."""
    magnitudes = np.abs(windows)
    present = magnitudes[magnitudes > 0]  # neither 0 nor NaN, as outside a mask
    if not present.size:
        return False
    # A few values may be damaged, and any number may be tiny, as in simulations.
    low, high = LARGEST_MAGNITUDES
    return bool(low <= np.percentile(present, 98) <= high)


def _extent(windows: NDArray[np.float64]) -> tuple[float, float]:
    """Return the range of the values without outliers."""
    low, high = np.percentile(windows, PERCENTILES)
    if low == high:
        low, high = windows.min(), windows.max()
    return float(low), float(high)
