import numpy as np
import pytest

from app.tf_editor.histogram import without_comb

SHAPE = 1000 * np.exp(-(((np.arange(256) - 120) / 50) ** 2)) + 20


@pytest.mark.parametrize("stretch", [2, 3, 7, 1.4])
def test_stretched_data_have_the_histogram_of_the_data_before(stretch):
    values = np.unique(np.floor(np.arange(0, 256, stretch)).astype(int))
    counts = np.zeros(256, dtype=np.int64)
    counts[values] = (SHAPE[values] * stretch).astype(np.int64)
    drawn = without_comb(counts)
    inner = slice(values[1], values[-2])
    assert (drawn[inner] > 0).all()
    if float(stretch).is_integer():
        assert drawn[inner] == pytest.approx(SHAPE[inner], rel=0.02)
    # Otherwise a tooth stands for as much as the one beside it, which has a wider gap.
    window = np.ones(14) / 14
    smooth, expected = (np.convolve(h[inner], window, "valid") for h in (drawn, SHAPE))
    assert smooth == pytest.approx(expected, rel=0.05)
    assert drawn.sum() == pytest.approx(counts.sum(), rel=0.02)


def test_gaps_that_are_not_a_combs_stay():
    counts = SHAPE.astype(np.int64)
    counts[100:140] = 0
    counts[200] = 0
    np.testing.assert_array_equal(without_comb(counts), counts)
    np.testing.assert_array_equal(without_comb(np.zeros(9, dtype=np.int64)), np.zeros(9))


def test_a_wide_gap_in_a_comb_stays_empty():
    counts = np.zeros(256, dtype=np.int64)
    counts[0:100:2] = counts[180:256:2] = 10
    drawn = without_comb(counts)
    assert (drawn[100:179] == 0).all()
    assert drawn[40:60] == pytest.approx(np.full(20, 5.0))
