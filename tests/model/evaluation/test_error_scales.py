"""Details of errors by their size, on images whose details are known."""

from __future__ import annotations

import numpy as np
import pytest

from model.evaluation.error_scales import ErrorScales


def test_the_details_add_up_to_the_mean_square() -> None:
    rng = np.random.default_rng(0)
    pairs = [(rng.random((16, 16, 3)), rng.random((16, 16, 3))) for _ in range(5)]
    totals = ErrorScales()
    for image, truth in pairs:
        totals.add(image, truth)
    scales = totals.scales()
    assert [scale.pixels for scale in scales] == [1, 2, 4, 8, 16]
    squares = np.mean([np.square(image - truth).mean() for image, truth in pairs])
    assert sum(scale.error for scale in scales) == pytest.approx(squares)
    truths = np.mean([np.square(truth).mean() for _, truth in pairs])
    assert sum(scale.truth for scale in scales) == pytest.approx(truths)


@pytest.mark.parametrize("pixels", [1, 2, 4])
def test_a_checkerboard_is_a_detail_of_its_squares(pixels: int) -> None:
    rows, columns = np.indices((8, 8)) // pixels
    board = np.repeat(((rows + columns) % 2)[..., None], 3, axis=2).astype(np.float64)
    totals = ErrorScales()
    totals.add(0.5 * board, board)
    found = {scale.pixels: scale for scale in totals.scales()}
    # Around its mean of 1/2, a board of 0 and 1 has a mean square of 1/4.
    assert found[pixels].truth == pytest.approx(0.25)
    assert found[pixels].error == pytest.approx(0.0625)
    assert found[8].truth == pytest.approx(0.25)
    rest = [scale.error for scale in found.values() if scale.pixels not in (pixels, 8)]
    assert rest == pytest.approx([0.0] * len(rest), abs=1e-15)


def test_what_is_off_as_a_whole_is_no_detail() -> None:
    truth = np.random.default_rng(1).random((4, 4, 3))
    totals = ErrorScales()
    totals.add(truth + 0.1, truth)
    assert [scale.error for scale in totals.scales()] == pytest.approx([0, 0, 0.01], abs=1e-15)
