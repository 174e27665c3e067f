"""Values that files hold where nothing was measured: far from all others, and repeated."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAMPLES = 1 << 18
"""Voxels that are looked at; all of a small volume."""

LEAST_SHARE = 0.001
"""Share of the voxels from which on a value counts as repeated."""

FEWEST = 8
"""Times that a value occurs, in a small volume."""

USUAL = (
    -9999.0,
    -99999.0,
    -999.0,
    -32768.0,
    32767.0,
    65535.0,
    1e20,
    1e30,
    1e36,
    9.969209968386869e36,
)
"""Values, or float32 numbers near them, that programs write where nothing was measured: a few
copies suffice."""

FAR = 4.0
"""Distance from the others from which on a value is far away, in widths of the others' range."""

TAIL = 0.001
"""Share of the others at each end that does not count for their width."""

FEWEST_OTHERS = 16
"""Different values that the others must have: a mask or labels have no fill value."""

MOST_FILLS = 4

NEAR, MOST_BETWEEN = 0.25, 0.01
"""Where between the others and a value "between" begins, and the most voxels there for each of
those of the value."""


def far_away_values(scalars: NDArray[np.generic], missing: NDArray[np.bool_] | None) -> list[float]:
    """Find values that are repeated and lie far from all others.

    Such as -9999, where other voxels lie from 0 to 240. A value is far away if the other voxels,
    without a thousandth of them at either end, take less than a quarter of the way to it, and if
    hardly any lie on that way. Eight bits have no room for such values.

    Parameters
    ----------
    scalars : ndarray, shape (nz, ny, nx)
        Finite.
    missing : ndarray of bool, shape (nz, ny, nx), or None
        Voxels that do not count.

    Returns
    -------
    list of float
        At most 4, in increasing order.
    """
    if scalars.dtype.itemsize < 2:
        return []
    chosen = _sample(scalars, missing)
    values, counts = np.unique(chosen, return_counts=True)
    numbers = np.abs(values.astype(np.float64)[:, None] - np.array(USUAL))
    is_usual = (numbers <= 1e-6 * np.abs(USUAL)).any(axis=1)
    least = np.where(is_usual, FEWEST, max(LEAST_SHARE * len(chosen), FEWEST))
    fills: list[float] = []
    kept = np.ones(len(values), bool)
    while len(fills) < MOST_FILLS and np.count_nonzero(kept) > FEWEST_OTHERS:
        place = _farthest(values, counts, kept, least)
        if place is None:
            break
        fills.append(values[place].item())
        kept[place] = False
    return sorted(fills) if np.count_nonzero(kept) >= FEWEST_OTHERS else []


def _sample(scalars: NDArray[np.generic], missing: NDArray[np.bool_] | None) -> NDArray[np.generic]:
    """Return some voxels, the same ones each time; all of a small volume."""
    if scalars.size <= SAMPLES:
        return scalars.ravel() if missing is None else scalars[~missing]
    places = np.unravel_index(
        np.random.default_rng(0).integers(0, scalars.size, SAMPLES), scalars.shape
    )
    found = scalars[places]
    return found if missing is None else found[~missing[places]]


def _farthest(
    values: NDArray[np.generic],
    counts: NDArray[np.int64],
    kept: NDArray[np.bool_],
    least: NDArray[np.floating],
) -> int | None:
    """Return the place of a repeated value that is far from all others that are kept.

    Values are repeated that occur at least `least` times, a number for each.
    """
    found, most = None, FAR
    for place in np.flatnonzero(kept & (counts >= least)):
        others = kept.copy()
        others[place] = False
        # The other fill values do not widen the range that the value is compared with.
        others &= ~_beyond(values, counts, others, least)
        upto = np.cumsum(counts[others])
        if not len(upto):
            continue
        ends = np.searchsorted(upto, [TAIL * upto[-1], (1 - TAIL) * upto[-1]])
        lo, hi = (float(value) for value in values[others][ends])
        value = float(values[place])
        distance = max(lo - value, value - hi)
        if (
            hi > lo
            and distance > most * (hi - lo)
            and _is_apart(values, counts, others, place, lo if value < lo else hi)
        ):
            found, most = int(place), distance / (hi - lo)
    return found


def _is_apart(
    values: NDArray[np.generic],
    counts: NDArray[np.int64],
    others: NDArray[np.bool_],
    place: np.intp,
    end: float,
) -> bool:
    """Whether hardly any values lie between a value and the end of the others' range.

    Where a detector was saturated many do: those at the edges of what was too bright.
    """
    value = float(values[place])
    near, far = sorted((end + NEAR * (value - end), value))
    numbers = values.astype(np.float64)
    between = others & (numbers > near) & (numbers < far)
    return bool(counts[between].sum() <= MOST_BETWEEN * counts[place])


def _beyond(
    values: NDArray[np.generic],
    counts: NDArray[np.int64],
    kept: NDArray[np.bool_],
    least: NDArray[np.floating],
) -> NDArray[np.bool_]:
    """Mark the repeated values at both ends that lie apart from the next one that is kept."""
    beyond = np.zeros(len(values), bool)
    places = np.flatnonzero(kept)
    if len(places) < FEWEST_OTHERS:
        return beyond
    numbers = values[places].astype(np.float64)
    inner = numbers[-3] - numbers[2]
    for ends in (places[:2], places[-2:][::-1]):
        gap = abs(float(values[ends[0]]) - float(values[ends[1]]))
        if counts[ends[0]] >= least[ends[0]] and gap > inner:
            beyond[ends[0]] = True
    return beyond
