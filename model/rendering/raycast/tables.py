"""Transfer functions as look-up tables of one sample's opacity and colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.rendering.opacity_correction import per_sample
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range

LEVELS_PER_BIN = 16
LEVELS = (TF_SAMPLES - 1) * LEVELS_PER_BIN + 1
"""Entries of the look-up tables, several per bin of the TF; the nearest one is taken."""

NOTHING = LEVELS
"""One more entry: what lies behind the end of a ray."""

TINY = 1e-30
"""The transparency of an opaque TF, so that its logarithm is a number."""


def opacity_table(
    opacity_tf: OpacityTF, scalar_range: Range, sample_distance: float
) -> NDArray[np.float32]:
    """Opacity of one sample at each level, corrected at the bins and linear between them.

    Returns
    -------
    ndarray of float32, shape (LEVELS + 1,)
        0 for :data:`NOTHING`.
    """
    opacity = per_sample(opacity_tf.sample(scalar_range), sample_distance)
    table = np.zeros(LEVELS + 1, dtype=np.float32)
    table[:LEVELS] = np.interp(_levels(), np.arange(TF_SAMPLES), opacity)
    return table


def color_table(
    color_tf: ColorTF, scalar_range: Range, opacity: NDArray[np.float32] | None = None
) -> NDArray[np.float32]:
    """Colour of one sample at each level, premultiplied by its opacity where that is given.

    Returns
    -------
    ndarray of float32, shape (4 * (LEVELS + 1),)
        Red, green, blue and opacity of the first level, then of the next; the
        opacity is 1 where none is given.
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
    """Extinction, and extinction times colour, integrated over the scalar value.

    Between two values the mean extinction is the difference of this table over
    the difference of the values: exact for a scalar that is linear between two
    samples, however narrow the TF's peaks are.

    Returns
    -------
    ndarray of float64, shape (LEVELS, 4)
        Per sample distance, over levels: extinction, then red, green and blue.
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
    """Mean of -log(1 - a) for opacities a that run linearly from first to last."""
    p, q = (np.maximum(1 - opacity, TINY) for opacity in (first, last))
    nearly_equal = np.abs(q - p) <= 1e-4 * np.maximum(p, q)
    with np.errstate(divide="ignore", invalid="ignore"):
        exact = 1 - (q * np.log(q) - p * np.log(p)) / (q - p)
    return np.where(nearly_equal, -np.log((p + q) / 2), exact)


def _levels() -> NDArray[np.float64]:
    """The levels, in bins."""
    return np.linspace(0, TF_SAMPLES - 1, LEVELS)
