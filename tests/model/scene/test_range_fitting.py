from __future__ import annotations

import numpy as np
import pytest

from model.scene.range_fitting import fit_to_range
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction

STOPS = ((0.0, 0.1, 0.2, 0.3), (50.0, 0.9, 0.5, 0.1), (100.0, 0.3, 0.8, 0.7))
MODES = TransferFunction(
    OpacityTF((0.0, 100.0), (GaussianMode(30.0, 10.0, 0.5), GaussianMode(80.0, 5.0, 0.9))),
    ColorTF((0.0, 100.0), STOPS),
)
CURVE = TransferFunction(
    OpacityTF((0.0, 100.0), points=((0.0, 0.2), (40.0, 1.0), (100.0, 0.0))),
    ColorTF((0.0, 100.0), STOPS),
)


@pytest.mark.parametrize("tf", [MODES, CURVE])
@pytest.mark.parametrize("scalar_range", [(0.0, 100.0), (20.0, 70.0), (-50.0, 300.0), (60.0, 90.0)])
def test_overlapping_ranges_keep_every_value(
    tf: TransferFunction, scalar_range: tuple[float, float]
) -> None:
    fitted = fit_to_range(tf, scalar_range)
    values = np.linspace(*scalar_range, 301)
    np.testing.assert_allclose(fitted.opacity(values), tf.opacity(values), atol=1e-12)
    np.testing.assert_allclose(fitted.color(values), tf.color(values), atol=1e-12)
    assert fitted.scalar_range == fitted.color.scalar_range == scalar_range
    assert (fitted.color.stops[0][0], fitted.color.stops[-1][0]) == scalar_range


@pytest.mark.parametrize("tf", [MODES, CURVE])
def test_ranges_without_a_common_value_are_stretched(tf: TransferFunction) -> None:
    fitted = fit_to_range(tf, (1000.0, 1200.0))
    own = np.linspace(0.0, 100.0, 101)
    np.testing.assert_allclose(fitted.opacity(1000 + 2 * own), tf.opacity(own), atol=1e-12)
    np.testing.assert_allclose(fitted.color(1000 + 2 * own), tf.color(own), atol=1e-12)


def test_the_own_range_changes_nothing() -> None:
    assert fit_to_range(MODES, (0.0, 100.0)) == MODES
    assert fit_to_range(CURVE, (0.0, 100.0)) == CURVE
