"""Image metrics of float arrays (H, W, 3) in [0, 1]; predictions are clipped first."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage.metrics import structural_similarity

from model.errors import require
from model.scene.inputs import rgb_to_lab

EMD_BINS = (8, 12, 12)  # bins of the colour histogram along L, a and b
RESAMPLES = 2000

LEAST_BRIGHTNESS = 0.06
"""Mean brightness from which an image shows enough to be compared by eye. Not opacity, as TFs of
dark colours give opaque, nearly black images."""

Image = NDArray[np.floating]


def rmse(image: Image, truth: Image) -> float:
    """Root mean squared error over all pixels and channels."""
    difference = np.clip(image, 0, 1).astype(np.float64) - truth
    return float(np.sqrt(np.mean(difference**2)))


def clearly_seen(rgba: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which RGBA images (n, H, W, 4) of uint8 are not nearly black."""
    brightness = rgba[..., :3].max(axis=-1).mean(axis=(1, 2), dtype=np.float64) / 255
    return np.asarray(brightness >= LEAST_BRIGHTNESS)


def ssim(image: Image, truth: Image) -> float:
    """Structural similarity (Wang et al. 2004) by windows of 7 x 7 pixels; 1 for equal images."""
    pair = np.clip(image, 0, 1).astype(np.float64), truth.astype(np.float64)
    return float(structural_similarity(*pair, channel_axis=-1, data_range=1.0))


def color_emd(image: Image, truth: Image) -> float:
    """Earth mover's distance between colour histograms in CIELAB (paper, section 6.3), in [0, 1].

    The ground distance is Euclidean between bin indices, divided by its maximum.
    """
    require("evaluate")
    import ot

    a, b = _histogram(image), _histogram(truth)
    used_a, used_b = np.flatnonzero(a), np.flatnonzero(b)
    cost = _ground_distance()[np.ix_(used_a, used_b)]
    return float(ot.emd2(a[used_a], b[used_b], np.ascontiguousarray(cost)))


def flip(image: Image, truth: Image) -> float:
    """Mean FLIP error: the perceived difference when alternating images (Andersson et al. 2020).

    Lies in [0, 1]; computed for the evaluator's default viewing distance (67 pixels per degree).
    """
    require("evaluate")
    import flip_evaluator

    pair = [np.ascontiguousarray(np.clip(x, 0, 1), dtype=np.float32) for x in (truth, image)]
    return float(flip_evaluator.evaluate(*pair, "LDR", applyMagma=False)[0].mean())


def summary(
    values: Sequence[float] | NDArray[np.float64], larger_is_better: bool = False
) -> dict[str, Any]:
    """Mean, median, the value that 95 % are better than ("p95"), and the mean's 95 % interval.

    The confidence interval is a bootstrap of 2,000 resamples with a fixed seed.
    """
    array = np.asarray(values, dtype=np.float64)
    drawn = np.random.default_rng(0).integers(len(array), size=(RESAMPLES, len(array)))
    interval = np.percentile(array[drawn].mean(axis=1), (2.5, 97.5))
    return {
        "mean": float(array.mean()),
        "median": float(np.median(array)),
        "p95": float(np.percentile(array, 5 if larger_is_better else 95)),
        "interval": [float(end) for end in interval],
    }


def _histogram(image: Image) -> NDArray[np.float64]:
    lab = rgb_to_lab(np.asarray(image, dtype=np.float32)).reshape(-1, 3)
    bins = np.array(EMD_BINS)
    index = np.clip(((lab + 1) / 2 * bins).astype(np.intp), 0, bins - 1)
    flat = np.ravel_multi_index(tuple(index.T), EMD_BINS)
    counts = np.bincount(flat, minlength=int(bins.prod())).astype(np.float64)
    return counts / counts.sum()


@cache
def _ground_distance() -> NDArray[np.float64]:
    index = np.stack(np.unravel_index(np.arange(np.prod(EMD_BINS)), EMD_BINS), axis=-1)
    distance = np.linalg.norm(index[:, None] - index[None], axis=-1)
    return distance / distance.max()
