"""A default transfer function (TF), derived from a volume's histogram."""

from bisect import bisect_left
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from model.scene.scene import default_scalar_window
from model.scene.thinned_volume import LEVELS, ThinnedVolume
from model.scene.transfer_function import (
    TF_SAMPLES,
    ColorTF,
    GaussianMode,
    OpacityTF,
    Range,
    TransferFunction,
)
from model.scene.volume import Volume

MODE_AMPLITUDES = (0.04, 0.12, 0.5)  # of modes that cover typical numbers of voxels, in order
TYPICAL_SHARE = 0.1  # share of the window's voxels within one width of a typical mode's mean

MODE_COLORS = ((0.30, 0.60, 0.98), (0.96, 0.47, 0.33), (1.0, 0.78, 0.42))
"""Blue, coral and gold, distinguishable with common colour blindnesses."""

END_COLORS = ((0.03, 0.07, 0.2), (1.0, 0.95, 0.86))  # dark blue, hardly visible, and ivory
SEEN_OPACITY, SMOKE_OPACITY = 0.9, 0.75  # least opacity of half of the rays; less in smoke
OPAQUE_RAY = 0.5  # opacity from which a ray counts as visible, with the mode at its highest

SURROUNDS, MOST_RIM = 1.05, 0.9
"""The rim's peak is background if its share of the rim is this many times its share of the volume,
or at least this large. Otherwise the object itself reaches the rim."""

MANY = 0.02  # share of the voxels above the window from which it ends with the range, as for bone
RIM_FLANK = 0.2  # height at which the rim's peak ends, as a fraction of the peak's height

DISTINCT = 3.0
"""Distance from the rim's peak to an end of the scalar range, in flanks of the peak, from which the
values there are not noise of the peak but something else to show."""

CALM_RIM = 0.95  # least share of the lowest value at the rim of smoke; scans of air have noise

SMOKE_STEPS, SMOKE_RISE, SMOKE_SPECKS = 16, 1.6, 0.02
"""In smoke, higher values are rarer: number of equal parts of the scalar range; largest ratio of a
part's voxels to a lower part's; and share of the voxels below which parts do not count."""

MOST_FACTOR, FACTORS = 32.0, 41  # largest factor of optical depths; number of factors tried
LEAST_AMPLITUDE, MOST_AMPLITUDE = 0.02, 0.9  # limits of the opacities of modes


def default_transfer_function(volume: Volume) -> TransferFunction:
    """Return a TF of three modes over the scalar window, with a light colour at each mode.

    The means divide the log-scaled histogram into equal parts, so that rare values count. Opacity
    grows with the value, and falls with the number of voxels near it, so that frequent values do
    not hide others. The most frequent value at the rim, such as air, has no mode if there is
    anything else. If the image would be faint, the strongest mode is raised; in smoke, which has no
    surfaces, all modes are raised, but less.
    """
    lo, hi = volume.scalar_range
    counts, edges = volume.histogram(256)
    thinned = ThinnedVolume.of(volume)
    window_lo, window_hi = _window_beyond_rim(volume, thinned)
    # Bins partly in the window are cut, as there may be only a few wide ones.
    inside = (edges[1:] > window_lo) & (edges[:-1] < window_hi)
    counts, starts, ends = counts[inside], edges[:-1][inside], edges[1:][inside]
    starts, ends = np.maximum(starts, window_lo), np.minimum(ends, window_hi)
    centers = (starts + ends) / 2
    means = _balanced_means(counts, np.append(starts, ends[-1]))
    width = float(min(np.diff(means).min() / 3, (hi - lo) / 24))
    # Halfway to the window's end, the highest mode still has a third of its opacity; but it
    # must not cover the one below.
    widest = max(width, 0.4 * (means[-1] - means[-2]), 0.5 * (window_hi - means[-1]))
    modes = []
    for mean, wide, base in zip(means, (width, width, widest), MODE_AMPLITUDES, strict=True):
        share = counts[np.abs(centers - mean) <= wide].sum() / max(counts.sum(), 1)
        amplitude = base * (TYPICAL_SHARE / max(share, 1e-6)) ** 0.5
        amplitude = round(min(max(amplitude, LEAST_AMPLITUDE), MOST_AMPLITUDE), 3)
        modes.append(GaussianMode(mean, wide, float(amplitude)))
    opacity = _raised(OpacityTF((lo, hi), tuple(modes), scale=volume.scale), thinned)
    colors = (END_COLORS[0], *MODE_COLORS, END_COLORS[1])
    stops = tuple((value, *color) for value, color in zip((lo, *means, hi), colors, strict=True))
    return TransferFunction(opacity, ColorTF((lo, hi), stops))


def _balanced_means(counts: NDArray[np.int64], edges: NDArray[np.float64]) -> list[float]:
    """Return one value per mode, spaced evenly in the cumulative log counts."""
    # Adding 1 keeps the cumulative counts strictly increasing across empty bins.
    shares = np.concatenate([[0.0], np.cumsum(np.log1p(counts) + 1.0)])
    number = len(MODE_AMPLITUDES)
    targets = shares[-1] * (np.arange(number) + 0.5) / number
    return [float(v) for v in np.interp(targets, shares, edges)]


def _rim(volume: ThinnedVolume) -> NDArray[np.int64]:
    """Levels of the visible voxels at the volume's six faces."""
    levels = volume.levels
    faces = [np.take(levels, place, axis).ravel() for axis in range(3) for place in (0, -1)]
    rim = np.concatenate(faces)
    return rim[rim < LEVELS].astype(np.int64)


def _window_beyond_rim(volume: Volume, thinned: ThinnedVolume) -> Range:
    """Return the scalar window without the peak of most of the rim, if any."""
    window_lo, window_hi = default_scalar_window(volume)
    everywhere = thinned.levels[thinned.levels < LEVELS].astype(np.int64) * TF_SAMPLES // LEVELS
    lo, hi = volume.scalar_range
    if np.mean(lo + everywhere * (hi - lo) / TF_SAMPLES >= window_hi) > MANY:
        window_hi = hi
    bins = np.bincount(_rim(thinned) * TF_SAMPLES // LEVELS, minlength=TF_SAMPLES)
    counts = np.convolve(bins, np.ones(5), mode="same")
    peak = int(counts.argmax())
    flanks = counts < RIM_FLANK * counts[peak]
    start = peak - int(np.argmax(np.append(flanks[peak::-1], True)))
    end = peak + int(np.argmax(np.append(flanks[peak:], True)))
    low, high = (lo + place * (hi - lo) / TF_SAMPLES for place in (start + 1, end))
    share = bins[start + 1 : end].sum() / max(bins.sum(), 1)
    inside = np.mean((everywhere > start) & (everywhere < end))
    if high <= window_lo or share < 0.5 or share < min(SURROUNDS * inside, MOST_RIM):
        return window_lo, window_hi
    center = lo + (peak + 0.5) * (hi - lo) / TF_SAMPLES
    if hi - center >= DISTINCT * (high - center):
        return high, max(window_hi, (high + hi) / 2)
    if center - lo >= DISTINCT * (center - low):
        return lo, 2 * low - center
    return window_lo, window_hi


def is_smoke(volume: ThinnedVolume) -> bool:
    """Whether a volume is a simulation's smoke: values fade away, and the rim is empty."""
    if np.mean(_rim(volume) == 0) < CALM_RIM:
        return False
    shown = volume.levels[volume.levels < LEVELS].astype(np.int64)
    parts = np.bincount(shown * SMOKE_STEPS // LEVELS, minlength=SMOKE_STEPS)[1:]
    lowest = np.minimum.accumulate(parts)[:-1]
    rises = parts[1:] > np.maximum(SMOKE_RISE * lowest, SMOKE_SPECKS * parts.sum())
    return bool(parts.any() and not rises.any())


def _raised(opacity: OpacityTF, volume: ThinnedVolume) -> OpacityTF:
    """Raise the strongest mode until rays are opaque; all modes if that fails, or in smoke."""
    everything = slice(None)
    through = volume.ray_opacities(_times(opacity, everything, MOST_FACTOR)) > OPAQUE_RAY
    if not through.any():
        return opacity
    smoke = is_smoke(volume)
    seen = SMOKE_OPACITY if smoke else SEEN_OPACITY
    factors = np.geomspace(1.0, MOST_FACTOR, FACTORS)
    for which in (everything,) if smoke else (_strongest(opacity, volume), everything):

        def is_seen(factor: float, start: OpacityTF = opacity, which: slice = which) -> bool:
            rays = volume.ray_opacities(_times(start, which, factor))[through]
            return bool(np.median(rays) >= seen)

        place = bisect_left(factors, True, hi=FACTORS - 1, key=is_seen)
        opacity = _times(opacity, which, float(factors[place]))
    return opacity


def _strongest(opacity: OpacityTF, volume: ThinnedVolume) -> slice:
    """Return the mode that adds most opacity to the volume, except the lowest, a haze."""
    sums = [volume.ray_opacities(replace(opacity, modes=(mode,))).sum() for mode in opacity.modes]
    place = 1 + int(np.argmax(sums[1:]))
    return slice(place, place + 1)


def _times(opacity: OpacityTF, which: slice, factor: float) -> OpacityTF:
    """Return the TF with some modes' optical depths multiplied by a factor, within limits."""
    modes = list(opacity.modes)
    modes[which] = [
        replace(m, amplitude=round(min(1 - (1 - m.amplitude) ** factor, MOST_AMPLITUDE), 3))
        for m in modes[which]
    ]
    return replace(opacity, modes=tuple(modes))


AIR_HU, TISSUE_HU = -1000.0, 50.0

FAT_PLACES = (0.75, 0.93)  # places of fat from air (0) to tissue (1), with contrast agent or not
LEAST_SHARE = 0.05  # least share of the voxels above air in fat and in soft tissue
NARROW = 0.08  # width of soft tissue's only peak, as a fraction of its distance from air
DENSE_SHARES = (0.01, 0.3)  # limits of the share of voxels above air in bone
PROMINENCE = 0.1  # height of a peak above its saddles, as a power of ten
SPECKS = 1e-4  # fraction of the voxels in a bin that is too small for a peak
SMOOTHING = 5  # bins of 256 over which a histogram is averaged


def body_range(volume: Volume) -> Range | None:
    """Return the values of -1000 and 50 HU if peaks reveal them with confidence, else None.

    Air must be the lowest peak. Above it are either two peaks at the distances of fat and soft
    tissue, or a single narrow one, as in a head. The amount of denser voxels must be plausible for
    bone, which may have peaks of its own.
    """
    counts, edges = volume.histogram(256)
    if np.count_nonzero(counts) < len(counts) / 2:
        # With few grey levels, each looks like a peak.
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
    """Bins of the peaks, including the ends but no noise."""
    smooth = np.convolve(counts, np.ones(SMOOTHING) / SMOOTHING, mode="same")
    heights = np.log10(smooth / counts.sum() + SPECKS)
    return [n - 1 for n, *_ in find_peaks(np.pad(heights, 1, constant_values=-9), PROMINENCE)]


def find_peaks(curve: NDArray[np.floating], least: float) -> list[tuple[int, float, float]]:
    """Find the peaks of a finite curve with some prominence, except at its ends.

    Each has its place, and to its left and right the places between samples where the curve is half
    of the prominence lower. SciPy's function takes half a second and 65 MB to load.
    """
    starts = np.flatnonzero(np.diff(curve, prepend=np.nan))  # of runs of equal samples
    middles, levels = (starts + np.append(starts[1:], len(curve)) - 1) // 2, curve[starts]
    found = []
    for place in middles[1:-1][(levels[1:-1] > levels[:-2]) & (levels[1:-1] > levels[2:])]:
        higher = np.flatnonzero(curve > curve[place])
        first = higher[higher < place].max(initial=-1) + 1
        last = higher[higher > place].min(initial=len(curve))
        sides = curve[first : place + 1][::-1], curve[place:last]
        prominence = curve[place] - max(side.min() for side in sides)
        if prominence >= least:
            left, right = (_steps_to(curve[place] - prominence / 2, side) for side in sides)
            found.append((int(place), float(place - left), float(place + right)))
    return found


def _steps_to(level: float, side: NDArray[np.floating]) -> float:
    """Return after how many samples a curve first falls to a level."""
    at = int(np.argmax(side <= level))
    return at - float((level - side[at]) / (side[at - 1] - side[at]))
