"""Paths between codes, along which TFs change evenly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.errors import LatentError
from model.latent.codes import Codes, TFCodec

STEPS_PER_LEG = 64
"""Points of a leg at which the change of the TF is measured."""


def path_codes(codec: TFCodec, stations: NDArray[np.floating], frames: int) -> Codes:
    """Codes (frames, d) along straight lines between codes, with even changes of the TF.

    Parameters
    ----------
    stations : ndarray, shape (k, d)
        Codes to visit, two at least.
    frames : int
        Number of codes, the first and the last station's included.

    Raises
    ------
    LatentError
        For fewer than two stations or frames.
    """
    if len(stations) < 2 or frames < 2:
        raise LatentError("A path needs two places at least: name some on the map.")
    legs = np.arange(len(stations), dtype=np.float64)
    fine = np.linspace(0, len(stations) - 1, (len(stations) - 1) * STEPS_PER_LEG + 1)
    between = np.stack([np.interp(fine, legs, column) for column in np.transpose(stations)], axis=1)
    steps = np.linalg.norm(np.diff(codec.decode(between), axis=0), axis=1)
    # A leg on which nothing changes still takes its time.
    length = np.concatenate([[0.0], np.cumsum(steps + 1e-3 * max(steps.max(), 1e-6))])
    at = np.interp(np.linspace(0, length[-1], frames), length, fine)
    return np.stack([np.interp(at, fine, column) for column in between.T], axis=1, dtype=np.float32)
