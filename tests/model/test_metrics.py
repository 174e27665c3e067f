import numpy as np
import ot
import pytest

from model import metrics
from model.scene.inputs import rgb_to_lab

RNG = np.random.default_rng(0)
NOISE = RNG.random((32, 32, 3))


def test_opaque_black_is_not_clearly_seen_but_a_red_corner_is():
    images = np.zeros((4, 8, 8, 4), dtype=np.uint8)
    images[0, ..., 3] = 255
    images[1] = 12, 12, 12, 255
    # A sixteenth of the pixels is bright red: a mean of .0625.
    images[2, :2, :2] = 255, 0, 0, 255
    images[3] = 40, 40, 40, 255
    assert metrics.clearly_seen(images).tolist() == [False, False, True, True]


def flat(*rgb):
    return np.broadcast_to(np.array(rgb, dtype=float), (32, 32, 3)).copy()


def test_errors_of_known_images():
    assert metrics.rmse(flat(0.5, 0.5, 0.5), flat(0.25, 0.25, 0.25)) == pytest.approx(0.25)
    assert metrics.rmse(flat(1, 0, 0), flat(0, 0, 0)) == pytest.approx(np.sqrt(1 / 3))
    # Predictions are clipped first.
    for error in (metrics.rmse, metrics.color_emd):
        assert error(flat(1.7, -3, 2), flat(1, 0, 1)) == 0
    assert metrics.color_emd(NOISE, NOISE) == pytest.approx(0, abs=1e-12)
    assert metrics.ssim(NOISE, NOISE) == pytest.approx(1)


def test_emd_agrees_with_the_full_transport_problem():
    image, truth = NOISE, np.clip(NOISE * 0.6 + 0.3, 0, 1)
    histograms = []
    for picture in (image, truth):
        lab = (rgb_to_lab(picture.astype(np.float32)).reshape(-1, 3) + 1) / 2
        counts, _ = np.histogramdd(lab, bins=metrics.EMD_BINS, range=[(0, 1)] * 3)
        histograms.append(counts.ravel() / counts.sum())
    index = np.stack(np.unravel_index(np.arange(8 * 12 * 12), metrics.EMD_BINS), axis=-1)
    cost = ot.dist(index.astype(float), metric="euclidean")
    expected = ot.emd2(*histograms, cost / cost.max())
    assert metrics.color_emd(image, truth) == pytest.approx(expected, abs=1e-9)


def test_the_interval_of_the_mean_is_the_normal_one_for_many_values():
    values = np.random.default_rng(1).normal(3.0, 2.0, 4000)
    low, high = metrics.summary(values)["interval"]
    half = 1.96 * values.std() / np.sqrt(4000)
    assert low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert high == pytest.approx(values.mean() + half, abs=0.1 * half)
    assert metrics.summary([0.5])["interval"] == [0.5, 0.5]


def test_a_summary_has_mean_median_and_the_worse_end():
    summary = metrics.summary(np.arange(101))
    assert [summary[key] for key in ("mean", "median", "p95")] == [50, 50, 95]
    assert metrics.summary(np.arange(101), larger_is_better=True)["p95"] == 5
