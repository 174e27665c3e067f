"""Error-driven sampling: samples with a high recent error are drawn more often."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

UNIFORM_SHARE = 0.5
"""Share of draws that is uniform; it bounds the weights by 1 / UNIFORM_SHARE."""


class Importance:
    """Draws samples in proportion to their error, with weights that undo the bias.

    A sample drawn with probability p among n gets the weight 1 / (n p), so
    that the expected weighted loss is the mean loss (importance sampling).

    Parameters
    ----------
    capacity : int
        How many consecutive samples are drawn from at once, at most.
    """

    def __init__(self, capacity: int) -> None:
        self._errors = np.full(capacity, np.nan)
        self._samples = np.full(capacity, -1, dtype=np.int64)

    def draw(
        self, window: NDArray[np.int64], count: int, rng: np.random.Generator
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Draw samples, with replacement.

        Parameters
        ----------
        window : ndarray of int64, shape (n,)
            Consecutive sample numbers, at most the capacity.
        count : int
        rng : numpy.random.Generator

        Returns
        -------
        chosen : ndarray of int64, shape (count,)
        weights : ndarray of float32, shape (count,)
        """
        probability = self._probabilities(window)
        chosen = rng.choice(len(window), count, p=probability)
        weights = 1 / (len(window) * probability[chosen])
        return window[chosen], weights.astype(np.float32)

    def update(self, samples: NDArray[np.int64], errors: NDArray[np.float32]) -> None:
        """Remember the latest error of samples."""
        slots = samples % len(self._errors)
        self._errors[slots] = errors
        self._samples[slots] = samples

    def _probabilities(self, window: NDArray[np.int64]) -> NDArray[np.float64]:
        slots = window % len(self._errors)
        errors = np.where(self._samples[slots] == window, self._errors[slots], np.nan)
        known = np.isfinite(errors)
        uniform = np.full(len(window), 1 / len(window))
        if not known.any():
            return uniform
        # Nothing is known of new samples: they count as average ones.
        errors = np.where(known, errors, errors[known].mean())
        total = errors.sum()
        if not total > 0:
            return uniform
        probability = UNIFORM_SHARE * uniform + (1 - UNIFORM_SHARE) * errors / total
        return np.asarray(probability / probability.sum())
