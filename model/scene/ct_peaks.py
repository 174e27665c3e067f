"""Air, fat and soft tissue of a CT scan whose values are no Hounsfield units (HU), by peaks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import Range
from model.scene.volume import Volume

AIR_HU, TISSUE_HU = -1000.0, 50.0

FAT_PLACES = (0.75, 0.93)
"""Places of fat between air (0) and soft tissue (1), with contrast agent or without."""

LEAST_SHARE = 0.05
"""Fraction of the voxels above air that fat and soft tissue must each have, about their peaks."""

NARROW = 0.08
"""Width at half the height of soft tissue's only peak, as a fraction of its distance from air."""

DENSE_SHARES = (0.01, 0.3)
"""Fraction of the voxels above air that may be much denser than soft tissue: bone."""

PROMINENCE = 0.1
"""Height of a peak above its saddles, as a power of ten."""

SPECKS = 1e-4
"""Fraction of the voxels in a bin that is too small for a peak."""

SMOOTHING = 5
"""Bins of 256 over which a histogram is averaged."""


def body_range(volume: Volume) -> Range | None:
    """Return the values of -1000 and 50 HU, or None unless peaks tell them with confidence.

    Air must be the volume's lowest peak. Above it there are either two peaks, as far from it as
    fat and soft tissue are, or a single narrow one, as in a head. What is denser than these is
    neither too little nor too much for bone, which may have peaks of its own.
    """
    counts, edges = volume.histogram(256)
    if np.count_nonzero(counts) < len(counts) / 2:
        # Of few grey levels each looks like a peak.
        return None
    peaks = [place for place in _peaks(counts) if place < len(counts) - SMOOTHING]
    if len(peaks) < 2:
        return None
    air, tissue = peaks[0], peaks[min(len(peaks), 3) - 1]
    bone = tissue + (tissue - air) // 4
    if any(place < bone for place in peaks[3:]):
        return None
    above = counts[(air + tissue) // 2 :].sum()
    if len(peaks) > 2:
        fat = peaks[1]
        valley = (fat + tissue) // 2
        shares = counts[2 * fat - valley : valley].sum(), counts[valley : 2 * tissue - valley].sum()
        if min(shares) < LEAST_SHARE * above:
            return None
        likely = bool(FAT_PLACES[0] <= (fat - air) / (tissue - air) <= FAT_PLACES[1])
    else:
        half = np.count_nonzero(counts[(air + tissue) // 2 :] > counts[tissue] / 2)
        likely = bool(half <= NARROW * (tissue - air))
    dense = counts[bone:].sum() / above
    if not (likely and DENSE_SHARES[0] <= dense <= DENSE_SHARES[1]):
        return None
    centers = (edges[:-1] + edges[1:]) / 2
    return float(centers[air]), float(centers[tissue])


def _peaks(counts: NDArray[np.int64]) -> list[int]:
    """Bins of the peaks, ends included, without those of noise."""
    # Late: the window opens without SciPy.
    from scipy.signal import find_peaks

    smooth = np.convolve(counts, np.ones(SMOOTHING) / SMOOTHING, mode="same")
    heights = np.log10(smooth / counts.sum() + SPECKS)
    places, _ = find_peaks(np.pad(heights, 1, constant_values=-9), prominence=PROMINENCE)
    return [int(place) - 1 for place in places]
