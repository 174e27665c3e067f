"""Distribution of a volume's voxels over scalar values: histograms and percentiles."""

import math
from collections.abc import Callable
from functools import cached_property
from threading import Lock
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from model.threads import in_threads

_COUNTABLE = 1 << 16  # most whole numbers that are counted one by one
_SAMPLES = 1 << 18  # sample of voxels for percentiles if there are more values
_KEPT = 16  # most cached histograms
_FEWEST_STEPS = 64  # most steps above 1 that bins follow
_EXACT = 2.0**52  # below this size a float holds whole numbers and halves
_MANY = 1 << 20  # voxels from which on threads save time
_CELLS = 1 << 14  # equal parts of a histogram's range; most of them lie in one bin
Range = tuple[float, float]
_T = TypeVar("_T")


class Distribution:
    """Distribution of voxels over scalar values, computed on first use."""

    def __init__(
        self, voxels: NDArray[np.generic], missing: NDArray[np.bool_] | None = None
    ) -> None:
        assert voxels.ndim == 3  # in a list, each voxel would be a slice
        self._voxels = voxels
        self._missing = missing
        self._histograms: dict[bytes, NDArray[np.int64]] = {}

    @cached_property
    def range(self) -> Range:
        """Smallest and largest voxel."""
        lowest, highest = self.ends
        return float(lowest), float(highest)

    @property
    def is_constant(self) -> bool:
        """Whether all voxels are equal, exactly, not as floats."""
        lowest, highest = self.ends
        return bool(lowest == highest)

    def of_planes(self, call: Callable[[NDArray[Any]], _T]) -> list[_T]:
        """Return what a function finds in the measured voxels (n,) of each slice along z."""
        places = range(len(self._voxels))
        if self._voxels.size < _MANY:
            return [call(self._measured(z)) for z in places]
        return in_threads(lambda z: call(self._measured(z)), places)

    def _measured(self, z: int) -> NDArray[Any]:
        plane = self._voxels[z]
        if self._missing is None or not self._missing[z].any():
            return plane.ravel()
        return plane[~self._missing[z]]

    @cached_property
    def ends(self) -> tuple[Any, Any]:
        """Smallest and largest voxel, of the voxels' own type; NaN if there is one."""
        found = self.of_planes(lambda plane: plane.size and (plane.min(), plane.max()))
        lows, highs = zip(*filter(None, found), strict=True)
        return np.min(lows), np.max(highs)

    @cached_property
    def is_whole(self) -> bool:
        """Whether the voxels are whole numbers, of whichever type."""
        if self._voxels.dtype.kind in "iu":
            return True
        values, _ = self.frequencies
        return bool((values == np.rint(values)).all())

    @cached_property
    def step(self) -> int | None:
        """Step of whole numbers: the greatest common divisor of all differences.

        It is above 1 in 8-bit data stretched to 16 bits, and counts as 1 if the voxels have few
        values, as in a mask of 0 and 255. None for other numbers, and for some that are too large.
        """
        lo, hi = self.range
        if not self.is_whole or max(abs(lo), abs(hi)) >= _EXACT:
            return None
        values, _ = self.frequencies
        # Relative to the smallest voxel, which a sample may lack.
        step = int(np.gcd.reduce(values.astype(np.int64) - int(lo)))
        return step if step > 0 and (hi - lo) / step >= _FEWEST_STEPS else 1

    @cached_property
    def frequencies(self) -> tuple[NDArray[np.generic], NDArray[np.int64]]:
        """Values in increasing order, and how often each occurs.

        Of all voxels if these are integers within 65,536 of each other, or few; otherwise of a
        fixed random sample of 262,144.
        """
        counts = self._whole_counts
        if counts is not None:
            occurring = np.flatnonzero(counts)
            return occurring + int(self.ends[0]), counts[occurring]
        values, counts = np.unique(self.sample, return_counts=True)
        return values, counts

    @cached_property
    def sample(self) -> NDArray[np.generic]:
        """A fixed random sample of 262,144 measured voxels; all of fewer."""
        voxels = self._voxels
        if self._missing is not None:
            return self._some_measured(self._missing)
        if voxels.size <= _SAMPLES:
            return voxels.ravel()
        chosen = np.random.default_rng(0).integers(0, voxels.size, _SAMPLES)
        return voxels[np.unravel_index(chosen, voxels.shape)]

    def histogram(self, edges: NDArray[np.float64]) -> NDArray[np.int64]:
        """Count the voxels between each edge and the next; the last bin includes its end."""
        key = edges.tobytes()
        counts = self._histograms.get(key)
        if counts is None:
            if len(self._histograms) >= _KEPT:
                self._histograms.clear()
            counts = self._histograms[key] = self._count(edges)
        return counts

    def edges(self, scalar_range: Range, bins: int, beyond: bool) -> NDArray[np.float64]:
        """Edges of at most this many equal bins over a range, and beyond it on demand.

        Bins of whole numbers hold equally many of them, with edges halfway between two; otherwise
        bins would alternate between one more and one less. See
        :meth:`model.scene.volume.Volume.histogram`.
        """
        lo, hi = scalar_range
        lowest, highest = self.range
        if self.step is None:
            edges = np.linspace(lo, hi, bins + 1)
        else:
            first = lowest + self.step * math.floor((lo - lowest) / self.step)
            count = math.ceil((hi - first) / self.step) + 1
            width = self.step * -(-count // bins)
            count = math.ceil((hi - first + self.step) / width)
            edges = first - self.step / 2 + width * np.arange(count + 1.0)
        if not beyond:
            return edges
        above = self._continued(edges[-1], highest, edges[1] - edges[0], bins)
        # Mirrored, values below are above.
        below = -self._continued(-edges[0], -lowest, edges[1] - edges[0], bins)
        return np.concatenate([below[::-1], edges, above])

    def _continued(self, start: float, end: float, width: float, bins: int) -> NDArray[np.float64]:
        """Edges after `start`, to `end` or beyond it, no nearer to each other than a width."""
        if end <= start:
            return np.empty(0)
        if self.step is None:
            # Compared before the division, which may overflow.
            fits = end - start <= width * bins
            count = math.ceil((end - start) / width) if fits else bins
            return np.linspace(start, end, count + 1)[1:]
        width *= math.ceil((end - start) / width / bins)
        return start + width * np.arange(1.0, math.ceil((end - start) / width) + 1)

    def _some_measured(self, missing: NDArray[np.bool_]) -> NDArray[np.generic]:
        """Random measured voxels by their rank, as few of many may be measured; all of few."""
        counts = [plane.size - int(np.count_nonzero(plane)) for plane in missing]
        total = sum(counts)
        if total <= _SAMPLES:
            return self._voxels[~missing]
        ranks = np.sort(np.random.default_rng(0).integers(0, total, _SAMPLES))
        ends = np.searchsorted(ranks, np.cumsum(counts))
        starts = np.cumsum(counts) - counts
        wanted = np.split(ranks - np.repeat(starts, np.diff(ends, prepend=0)), ends[:-1])
        return np.concatenate([self._measured(z)[own] for z, own in enumerate(wanted)])

    def _count(self, edges: NDArray[np.float64]) -> NDArray[np.int64]:
        counts = self._whole_counts
        if counts is not None:
            values = np.arange(len(counts)) + int(self.ends[0])
            return np.histogram(values, bins=edges, weights=counts)[0].astype(np.int64)
        return np.sum(self.of_planes(_counter(edges)), axis=0)

    @cached_property
    def _whole_counts(self) -> NDArray[np.int64] | None:
        """Number of voxels of each whole number from the smallest on; None for too many numbers."""
        if self._voxels.dtype.kind not in "iu":
            return None
        lowest, highest = map(int, self.ends)
        if highest - lowest >= _COUNTABLE:
            return None
        counts, adding = np.zeros(highest - lowest + 1, dtype=np.int64), Lock()

        def count(plane: NDArray[Any]) -> None:
            # The difference might overflow in the voxels' own type.
            places = plane.astype(np.int64) - lowest if lowest else plane
            found = np.bincount(places, minlength=len(counts))
            with adding:
                np.add(counts, found, out=counts)

        self.of_planes(count)
        return counts


def _counter(edges: NDArray[np.float64]) -> Callable[[NDArray[Any]], NDArray[np.int64]]:
    """Return a function that counts values as `np.histogram` does, which sorts all of them."""
    lowest, factor = edges[0], (_CELLS - 1) / (edges[-1] - edges[0])

    def cells_of(values: NDArray[Any]) -> NDArray[np.intp]:
        with np.errstate(over="ignore"):
            cells = np.subtract(values, lowest, dtype=np.float64) * factor
        return np.clip(cells, 0, _CELLS - 1, out=cells).astype(np.intp)

    # As rounding keeps the order, what is in a cell without an edge is in one bin. What is beyond
    # all edges is in the first or last cell.
    ends = cells_of(edges)
    bins, is_clear = np.searchsorted(ends, np.arange(_CELLS)) - 1, np.ones(_CELLS, bool)
    is_clear[ends] = is_clear[[0, -1]] = False

    def count(values: NDArray[Any]) -> NDArray[np.int64]:
        cells = cells_of(values)
        numbers = np.bincount(cells, minlength=_CELLS)[is_clear]
        clear = np.bincount(bins[is_clear], numbers, len(edges) - 1).astype(np.int64)
        rest: NDArray[np.int64] = np.histogram(values[~is_clear[cells]], edges)[0]
        return clear + rest

    return count
