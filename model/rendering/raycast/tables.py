"""Look-up tables of a sample's opacity and colour, from transfer functions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.rendering.opacity_correction import per_sample
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range

LEVELS_PER_BIN = 16
LEVELS = (TF_SAMPLES - 1) * LEVELS_PER_BIN + 1
"""Number of look-up table entries, several per bin of the TF; the nearest one is used."""

FARTHEST_LEVELS = (LEVELS - 1) * 256
"""How far beyond the tables pre-integration looks: as many ranges as voxels may lie beyond."""

NOTHING = LEVELS
"""An additional, transparent entry for samples beyond the end of a ray."""

TINY = 1e-30
"""Least transparency of a TF, so that its logarithm is finite."""


def opacity_table(
    opacity_tf: OpacityTF, scalar_range: Range, sample_distance: float
) -> NDArray[np.float32]:
    """Return a sample's opacity at each level, corrected at the bins and linear between them.

    Returns
    -------
    ndarray of float32, shape (LEVELS + 1,)
        0 for :data:`NOTHING`.
    """
    return level_table(per_sample(opacity_tf.sample(scalar_range), sample_distance))


def level_table(bins: NDArray[np.floating]) -> NDArray[np.float32]:
    """Interpolate values of 256 bins at each level, shape (LEVELS + 1,); 0 for :data:`NOTHING`."""
    table = np.zeros(LEVELS + 1, dtype=np.float32)
    table[:LEVELS] = np.interp(_levels(), np.arange(TF_SAMPLES), bins)
    return table


def color_table(
    color_tf: ColorTF, scalar_range: Range, opacity: NDArray[np.float32] | None = None
) -> NDArray[np.float32]:
    """Return a sample's RGBA at each level, premultiplied if its opacity is given.

    Returns
    -------
    ndarray of float32, shape (4 * (LEVELS + 1),)
        Red, green, blue and opacity of the first level, then of the next ones;
        the opacity is 1 if none is given.
    """
    bins = color_tf.sample(scalar_range)
    levels, every = _levels(), np.arange(TF_SAMPLES)
    table = np.zeros((LEVELS + 1, 4), dtype=np.float32)
    for channel in range(3):
        table[:LEVELS, channel] = np.interp(levels, every, bins[:, channel])
    table[:LEVELS, 3] = 1
    if opacity is not None:
        table *= opacity[:, None]
    return table.ravel()


def preintegrated_table(
    opacity_tf: OpacityTF,
    color_tf: ColorTF | None,
    scalar_range: Range,
    sample_distance: float,
) -> NDArray[np.float64]:
    """Integrate extinction, and extinction times colour, over the scalar value.

    The mean extinction between two values is the difference of table entries
    divided by the difference of levels. It is exact if the scalar is linear between
    two samples, even for narrow peaks of the TF.

    Returns
    -------
    ndarray of float64, shape (LEVELS, 4)
        Cumulative integrals, per sample distance, of extinction and of extinction
        times red, green and blue.
    """
    levels, every = _levels(), np.arange(TF_SAMPLES)
    opacity = np.interp(levels, every, opacity_tf.sample(scalar_range))
    extinction = sample_distance * _mean_extinction(opacity[:-1], opacity[1:])
    table = np.zeros((LEVELS, 4))
    table[1:, 0] = np.cumsum(extinction)
    if color_tf is not None:
        bins = color_tf.sample(scalar_range)
        color = np.stack([np.interp(levels, every, channel) for channel in bins.T], axis=1)
        table[1:, 1:] = np.cumsum(extinction[:, None] * (color[:-1] + color[1:]) / 2, axis=0)
    return table


def _mean_extinction(first: NDArray[np.float64], last: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean of -log(1 - a) for opacities a that vary linearly from first to last."""
    p, q = (np.maximum(1 - opacity, TINY) for opacity in (first, last))
    nearly_equal = np.abs(q - p) <= 1e-4 * np.maximum(p, q)
    with np.errstate(divide="ignore", invalid="ignore"):
        exact = 1 - (q * np.log(q) - p * np.log(p)) / (q - p)
    return np.where(nearly_equal, -np.log((p + q) / 2), exact)


def _levels() -> NDArray[np.float64]:
    """Positions of the levels, in TF bins."""
    return np.linspace(0, TF_SAMPLES - 1, LEVELS)
