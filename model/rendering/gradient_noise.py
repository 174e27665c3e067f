"""Noise of a volume's gradients, below which their direction tells nothing about a surface."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import Range
from model.scene.volume import Triple

BLOCKS, EDGE = 2048, 6
"""Number of blocks that are looked at, and their edge in voxels."""

LEAST_EDGE = 5
"""Voxels along each axis from which on there are gradients beside one another to compare."""

UNRELATED = 0.4
"""Correlation of gradients one voxel apart below which a block counts as noise."""

LEAST_SHARE = 0.02
"""Share of blocks with noise from which on a volume counts as noisy."""

TIMES_NOISE, LEAST_GRADIENT = 3.0, 2e-5
"""Length of the gradient, in that of the noise's and at least, from which on it counts in full.

A shorter one counts by the fourth power of that: noise itself by 1/81.
"""

EVEN = 0.5
"""Light on what has no surface: the mean over surfaces of all directions."""

FARTHEST = 4.0
"""How far values may lie beyond the scalar range, in widths of it; farther ones are clamped."""


def gradient_noise(scalars: NDArray[Any], scalar_range: Range, spacing: Triple) -> float:
    """Root mean square of the gradient's length where there is nothing but noise.

    Next to one another, gradients of a surface or of anything that is resolved are alike; those
    of noise are not. The blocks of voxels in which they are not are taken, and of these the
    median, so that the few of them with thin structures do not count. Blocks of a single value,
    as clipping leaves them, tell nothing.

    Parameters
    ----------
    scalars : ndarray, shape (nz, ny, nx)
    scalar_range : tuple of float
    spacing : tuple of float
        Along x, y and z, in any unit.

    Returns
    -------
    float
        Differences between the next and the previous voxel, in scalar ranges and per voxel (of
        a cube with a voxel's volume). 0 for a volume without noise, or one too small to tell.
    """
    if min(scalars.shape) < LEAST_EDGE:
        return 0.0
    lo, hi = scalar_range
    values = (_blocks(scalars).astype(np.float64) - lo) / (hi - lo)
    values = np.clip(values, -FARTHEST, 1 + FARTHEST, out=values)
    unit = math.prod(spacing) ** (1 / 3)
    inner = slice(1, -1)
    gradients = np.stack(
        [
            (values[:, inner, inner, 2:] - values[:, inner, inner, :-2]) * (unit / spacing[0]),
            (values[:, inner, 2:, inner] - values[:, inner, :-2, inner]) * (unit / spacing[1]),
            (values[:, 2:, inner, inner] - values[:, :-2, inner, inner]) * (unit / spacing[2]),
        ],
        axis=-1,
    )
    square = (gradients**2).sum(axis=-1).mean(axis=(1, 2, 3))
    shared = np.zeros_like(square)
    for axis in (1, 2, 3):
        first, second = _neighbors(gradients, axis)
        shared += (first * second).sum(axis=-1).mean(axis=(1, 2, 3)) / 3
    noise = square[(square > 0) & (shared < UNRELATED * square)]
    if len(noise) < LEAST_SHARE * len(square):
        return 0.0
    return float(np.sqrt(np.median(noise)))


def certain_gradient(noise: float) -> float:
    """Return the gradient's length from which on it counts in full, in the noise's unit."""
    return max(TIMES_NOISE * noise, LEAST_GRADIENT)


def _blocks(scalars: NDArray[Any]) -> NDArray[Any]:
    """Return blocks of voxels (n, edge, edge, edge) at places that are always the same."""
    edge = min(EDGE, *scalars.shape)
    numbers = np.random.default_rng(0)
    corners = numbers.integers(0, np.array(scalars.shape) - edge + 1, (BLOCKS, 3))
    blocks = np.empty((BLOCKS, edge, edge, edge), dtype=scalars.dtype)
    for block, (z, y, x) in zip(blocks, corners, strict=True):
        block[...] = scalars[z : z + edge, y : y + edge, x : x + edge]
    return blocks


def _neighbors(gradients: NDArray[Any], axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return all gradients but the last along an axis, and the ones after these."""
    before: list[slice] = [slice(None)] * gradients.ndim
    behind = before.copy()
    before[axis], behind[axis] = slice(None, -1), slice(1, None)
    return gradients[tuple(before)], gradients[tuple(behind)]
