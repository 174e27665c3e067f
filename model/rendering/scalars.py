"""Scalars in the types that renderers take, and an estimate of their noise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.scene.filling import fill
from model.scene.mask import Mask, grown, masked_voxels
from model.scene.transfer_function import Range
from model.scene.volume import Volume
from model.threads import in_threads

WELL_CONDITIONED = 256.0
"""Largest ratio of absolute values to their range for which float32 is used unchanged.

At this ratio rounding errors are 1/256 of a TF bin.
"""

NARROWEST, WIDEST = 1e-4, 1e6
"""Limits of the scalar range of floats within which float32 suffices for rendering.

Shading takes fourth powers of differences, from 1e-5 of the range (weak noise) to :data:`BEYOND`
times the range (next to outliers).
"""

LEAST_RANGE, GREATEST_RANGE = 1e-30, 1e30  # so that float32 holds a range and its reciprocal

BEYOND = 256.0
"""How far floats may lie beyond the scalar range, in widths of it; farther ones are clamped.

Renderers clamp after interpolation: clamping before it would move interpolated values. But next to
an outlier of 1e30, float32 would lose all digits; at this distance it rounds to 1/256 of a TF bin.
"""


MASKED, MISSING = np.uint8(1), np.uint8(2)
"""Marks of hidden voxels, which add up: hidden by a mask; missing."""

NOTHING_HIDDEN = np.empty(0, dtype=np.uint8)

KERNEL_TYPES = (np.uint8, np.uint16, np.int16, np.float32)  # what kernels support directly


def renderable_scalars(
    volume: Volume, native: tuple[type[np.generic], ...]
) -> tuple[NDArray[Any], Range]:
    """Return scalars for a renderer, and their range."""
    values = volume.shown
    if keeps_type(volume, native):
        voxels = values if values.dtype.kind != "f" else _clamped_far_out(volume, values)
        return np.ascontiguousarray(voxels), volume.scalar_range
    scaled = np.empty(values.shape, dtype=np.float32)
    lo, hi = volume.scalar_range
    lowest, highest = _limits(volume)

    def scale(z: int) -> None:
        doubles = np.clip(values[z], lowest, highest, dtype=np.float64)
        # In place: what memory costs is more than the arithmetic.
        doubles -= lo
        np.divide(doubles, hi - lo, out=scaled[z], casting="same_kind")

    in_threads(scale, range(len(values)))
    return scaled, (0.0, 1.0)


def keeps_type(volume: Volume, native: tuple[type[np.generic], ...]) -> bool:
    """Return whether :func:`renderable_scalars` leaves the type of the voxels as it is."""
    lo, hi = volume.scalar_range
    kind = volume.voxels.dtype
    well_conditioned = max(abs(lo), abs(hi)) / WELL_CONDITIONED <= hi - lo
    if kind.kind == "f":
        fits = well_conditioned and NARROWEST <= hi - lo <= WIDEST
    else:
        # From an integer, an end of the range that float32 holds exactly is subtracted exactly.
        fits = well_conditioned or float(np.float32(lo)) == lo
        fits &= LEAST_RANGE <= hi - lo <= GREATEST_RANGE
    return kind in native and fits


def blurred(scalars: NDArray[Any]) -> NDArray[Any]:
    """Return a cubic B-spline's values at the voxels, in their type."""
    found, last = np.empty_like(scalars), len(scalars) - 1
    shares = np.array([1, 4, 1], dtype=np.float32) / 6

    def blur(z: int) -> None:
        near = scalars[[max(z - 1, 0), z, min(z + 1, last)]]
        plane = np.tensordot(shares, near, 1)
        for _axis in "yx":
            around = np.pad(plane, ((1, 1), (0, 0)), mode="edge")
            plane = (shares[0] * (around[:-2] + around[2:]) + shares[1] * plane).T
        found[z] = plane if found.dtype.kind == "f" else np.rint(plane)

    in_threads(blur, range(len(scalars)))
    return found


def marks_of(volume: Volume, mask: Mask | None) -> NDArray[np.uint8]:
    """Return marks of a volume's voxels that are hidden, as kernels take them; none without any."""
    missing = volume.hidden
    if mask is None:
        return NOTHING_HIDDEN if missing is None else np.ravel(missing) * MISSING
    masked = masked_voxels(volume, mask)
    if missing is None:
        return np.ravel(masked) * MASKED
    # Missing voxels count as masked next to masked ones only, so that they add no mask's edge.
    return np.ravel(grown(masked & ~missing, ~missing) * MASKED | missing * MISSING)


def masked_scalars(scalars: NDArray[Any], volume: Volume, mask: Mask | None) -> NDArray[Any]:
    """Return scalars in which voxels that a mask hides have values like the shown ones around them.

    Samples at its edge are interpolated with them, and would have values that it hides. Lower
    values stay, as the surfaces of what is shown fade towards them.
    """
    if mask is None or volume.file.is_labels:
        return scalars
    filled = fill(scalars.copy(), masked_voxels(volume, mask))
    return np.minimum(scalars, filled, out=filled)


def _clamped_far_out(volume: Volume, voxels: NDArray[Any]) -> NDArray[Any]:
    """Clamp voxels :data:`BEYOND` the scalar range; without a copy where there are none."""
    lowest, highest = _limits(volume)
    if (lowest, highest) == volume.data_range:
        return voxels
    return np.clip(voxels, lowest, highest)


def _limits(volume: Volume) -> Range:
    """Smallest and largest voxel, or what voxels :data:`BEYOND` the range become."""
    (lo, hi), (lowest, highest) = volume.scalar_range, volume.data_range
    return max(lo - BEYOND * (hi - lo), lowest), min(hi + BEYOND * (hi - lo), highest)


SAMPLES = 1 << 15  # voxels that are looked at, drawn at random, the same ones each time
BINS, WIDE = 32, 4  # bins of values, and how many in a row may be one material
MATERIAL = 0.05  # share of the voxels from which on these count as a material
QUARTILE = 0.31864  # a quarter of normally distributed numbers stay below, in deviations
LABEL_NOISE = 0.02  # in place of noise, for a label's share: deep inside it has no direction

_WEIGHTS = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


def noise_of(scalars: NDArray[Any]) -> float:
    """Estimate the standard deviation of the voxels' noise, in their own units.

    It is derived from fourth differences, in which smooth structures cancel. The lower quartile of
    their size ignores surfaces, in each range of values apart: air, which fills most scans, may
    have less noise than material. The noisiest material counts.
    """
    random = np.random.default_rng(0)
    values, sizes = [], []
    for axis, length in enumerate(scalars.shape):
        if length < len(_WEIGHTS):
            continue
        places = [random.integers(0, n, SAMPLES) for n in scalars.shape]
        places[axis] = random.integers(2, length - 2, SAMPLES)
        total, mean = np.zeros(SAMPLES), np.zeros(SAMPLES)
        for offset, weight in zip(range(-2, 3), _WEIGHTS, strict=True):
            at = tuple(p + offset * (n == axis) for n, p in enumerate(places))
            scalar = scalars[at].astype(np.float64)
            total += weight * scalar
            mean += scalar / len(_WEIGHTS)
        values.append(mean)
        sizes.append(np.abs(total) / np.sqrt((_WEIGHTS**2).sum()))
    if not values:
        return 0.0
    value, size = np.concatenate(values), np.concatenate(sizes)
    # A few outliers would leave the materials a single bin.
    lo, hi = np.quantile(value, [0.005, 0.995])
    if not hi > lo:
        return float(np.quantile(size, 0.25)) / QUARTILE
    in_bin = np.clip((value - lo) / (hi - lo) * BINS, 0, BINS - 1).astype(np.int64)
    quartiles = []
    for first in range(BINS - WIDE + 1):
        inside = size[(in_bin >= first) & (in_bin < first + WIDE)]
        if len(inside) >= MATERIAL * len(value):
            quartiles.append(float(np.quantile(inside, 0.25)))
    return max(quartiles, default=float(np.quantile(size, 0.25))) / QUARTILE
