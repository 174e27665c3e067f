"""Look-up tables of a sample's opacity and colour, from transfer functions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.rendering.opacity_correction import per_sample
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range

LEVELS_PER_BIN = 16
LEVELS = (TF_SAMPLES - 1) * LEVELS_PER_BIN + 1
"""Number of look-up table entries, several per bin of the TF; the nearest one is used."""

NOTHING = LEVELS
"""An additional, transparent entry for samples beyond the end of a ray."""


def opacity_table(
    opacity_tf: OpacityTF, scalar_range: Range, sample_distance: float
) -> NDArray[np.float32]:
    """Return a sample's opacity at each level, corrected at the bins and linear between them."""
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


def _levels() -> NDArray[np.float64]:
    """Positions of the levels, in TF bins."""
    return np.linspace(0, TF_SAMPLES - 1, LEVELS)
