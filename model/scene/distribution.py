"""Distribution of a volume's voxels over scalar values: histograms and percentiles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

_COUNTABLE = 1 << 16  # whole numbers at most that are counted one by one
_SAMPLES = 1 << 18  # voxels that percentiles are taken of where there are more values
_KEPT = 16  # most histograms that are kept
_FEWEST_STEPS = 64  # of more than 1, that data must have for bins to follow them
_EXACT = 2.0**52  # below this size a float holds whole numbers and halves
Range = tuple[float, float]


class Distribution:
    """Distribution of voxels over scalar values; all of it is computed when first asked for."""

    def __init__(
        self, voxels: NDArray[np.generic], missing: NDArray[np.bool_] | None = None
    ) -> None:
        self._voxels = voxels
        self._missing = missing
        self._histograms: dict[bytes, NDArray[np.int64]] = {}

    @cached_property
    def range(self) -> Range:
        """Smallest and largest voxel."""
        lowest, highest = self._ends
        return float(lowest), float(highest)

    @property
    def is_constant(self) -> bool:
        """Whether all voxels are equal, even where floats cannot tell them apart."""
        lowest, highest = self._ends
        return bool(lowest == highest)

    def planes(self) -> Iterator[NDArray[Any]]:
        """Yield the voxels that count, those of one z at a time, in an array of any shape."""
        if self._missing is None:
            yield from self._voxels
        else:
            for plane, missing in zip(self._voxels, self._missing, strict=True):
                yield plane[~missing]

    @cached_property
    def _ends(self) -> tuple[Any, Any]:
        """Smallest and largest voxel, of the voxels' own type."""
        if self._missing is None:
            return self._voxels.min(), self._voxels.max()
        ends = [(plane.min(), plane.max()) for plane in self.planes() if plane.size]
        return min(low for low, _ in ends), max(high for _, high in ends)

    @cached_property
    def is_whole(self) -> bool:
        """Whether the voxels are whole numbers, of whichever type."""
        if self._voxels.dtype.kind in "iu":
            return True
        values, _ = self.frequencies
        return bool((values == np.rint(values)).all())

    @cached_property
    def step(self) -> int | None:
        """Distance of which all differences of voxels are multiples, for whole numbers.

        It is more than 1 where 8-bit data were stretched to 16 bits, say; 1 where it is so
        large that the voxels have few values, such as a mask of 0 and 255. None for others
        than whole numbers, and for some too large to be distinguished from them.
        """
        lo, hi = self.range
        if not self.is_whole or max(abs(lo), abs(hi)) >= _EXACT:
            return None
        values, _ = self.frequencies
        # With the smallest voxel, which a sample may lack.
        step = int(np.gcd.reduce(values.astype(np.int64) - int(lo)))
        return step if step > 0 and (hi - lo) / step >= _FEWEST_STEPS else 1

    @cached_property
    def frequencies(self) -> tuple[NDArray[np.generic], NDArray[np.int64]]:
        """Values in increasing order, and how often each occurs.

        Of all voxels where these are integers within 65,536 of each other, or few;
        otherwise of 262,144 voxels drawn at random, the same ones each time.
        """
        counts = self._whole_counts
        if counts is not None:
            occurring = np.flatnonzero(counts)
            return occurring + int(self._ends[0]), counts[occurring]
        voxels = self._voxels
        if self._missing is not None:
            voxels = self._some_measured(self._missing)
        elif voxels.size > _SAMPLES:
            chosen = np.random.default_rng(0).integers(0, voxels.size, _SAMPLES)
            voxels = voxels[np.unravel_index(chosen, voxels.shape)]
        values, counts = np.unique(voxels, return_counts=True)
        return values, counts

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
        """Edges of at most so many equal bins over a range, and beyond it on demand.

        Bins of whole numbers hold equally many of them, and have their edges halfway between
        two: other bins would hold now one more, now one less. See
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
        # Mirrored, what lies below lies above.
        below = -self._continued(-edges[0], -lowest, edges[1] - edges[0], bins)
        return np.concatenate([below[::-1], edges, above])

    def _continued(self, start: float, end: float, width: float, bins: int) -> NDArray[np.float64]:
        """Edges after `start`, to `end` or beyond it, no nearer to each other than a width."""
        if end <= start:
            return np.empty(0)
        if self.step is None:
            # Compared before it is divided, which may overflow.
            fits = end - start <= width * bins
            count = math.ceil((end - start) / width) if fits else bins
            return np.linspace(start, end, count + 1)[1:]
        width *= math.ceil((end - start) / width / bins)
        return start + width * np.arange(1.0, math.ceil((end - start) / width) + 1)

    def _some_measured(self, missing: NDArray[np.bool_]) -> NDArray[np.generic]:
        """Measured voxels drawn at random by their rank, as few of many may be; all of few."""
        counts = [plane.size - int(np.count_nonzero(plane)) for plane in missing]
        total = sum(counts)
        if total <= _SAMPLES:
            return self._voxels[~missing]
        ranks = np.sort(np.random.default_rng(0).integers(0, total, _SAMPLES))
        ends = np.searchsorted(ranks, np.cumsum(counts))
        starts = np.cumsum(counts) - counts
        chosen, first = [], 0
        for plane, start, end in zip(self.planes(), starts, ends, strict=True):
            chosen.append(plane[ranks[first:end] - start])
            first = end
        return np.concatenate(chosen)

    def _count(self, edges: NDArray[np.float64]) -> NDArray[np.int64]:
        counts = self._whole_counts
        if counts is not None:
            values = np.arange(len(counts)) + int(self._ends[0])
            return np.histogram(values, bins=edges, weights=counts)[0].astype(np.int64)
        total = np.zeros(len(edges) - 1, dtype=np.int64)
        # Plane by plane: `np.histogram` would otherwise copy the whole volume to float64.
        for plane in self.planes():
            total += np.histogram(plane, bins=edges)[0]
        return total

    @cached_property
    def _whole_counts(self) -> NDArray[np.int64] | None:
        """Number of voxels of each whole number from the smallest on; None if those are many."""
        if self._voxels.dtype.kind not in "iu":
            return None
        lowest, highest = int(self._ends[0]), int(self._ends[1])
        if highest - lowest >= _COUNTABLE:
            return None
        counts = np.zeros(highest - lowest + 1, dtype=np.int64)
        for plane in self.planes():
            # In the voxels' own type the difference might overflow.
            places = plane.ravel().astype(np.int64) - lowest if lowest else plane.ravel()
            counts += np.bincount(places, minlength=len(counts))
        return counts
