"""Peaks of curves, against SciPy's."""

import numpy as np
import pytest
import scipy.signal

from model.sensitivity.peaks import find_peaks


def scipy_peaks(curve, least_prominence):
    places, found = scipy.signal.find_peaks(curve, prominence=least_prominence, plateau_size=1)
    data = found["prominences"], found["left_bases"], found["right_bases"]
    _, _, lefts, rights = scipy.signal.peak_widths(curve, places, 0.5, data)
    return np.stack([places, found["prominences"], lefts, rights], axis=1)


def own_peaks(curve, least_prominence):
    peaks = find_peaks(curve, least_prominence)
    return np.array([(p.place, p.prominence, p.left, p.right) for p in peaks]).reshape(-1, 4)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("levels", [3, 8, None])
def test_peaks_are_those_of_scipy(seed, levels):
    rng = np.random.default_rng(seed)
    curve = np.convolve(rng.random(258), np.ones(1 + seed % 4), "same")
    if levels is not None:
        # Few levels make plateaus, and peaks of the same height.
        curve = np.round(levels * curve / curve.max())
    least = 0.1 * curve.max() if seed % 2 else 1e-9
    np.testing.assert_allclose(own_peaks(curve, least), scipy_peaks(curve, least), atol=1e-12)


@pytest.mark.parametrize("curve", [np.zeros(258), np.arange(258.0), np.ones(1), np.zeros(3)])
def test_a_curve_that_does_not_rise_and_fall_has_no_peaks(curve):
    assert find_peaks(curve, 0.0) == []


def test_a_padded_rise_to_the_end_is_a_peak():
    (peak,) = find_peaks(np.pad(np.arange(1.0, 257.0), 1), 1.0)
    assert (peak.place, peak.prominence, peak.left) == (256, 256.0, 128.0)
