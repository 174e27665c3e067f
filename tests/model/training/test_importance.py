from __future__ import annotations

import numpy as np
import pytest

from model.training.importance import UNIFORM_SHARE, Importance


def test_weights_undo_the_bias() -> None:
    importance = Importance(64)
    window = np.arange(100, 164)
    errors = np.random.default_rng(0).gamma(1.0, size=64).astype(np.float32)
    importance.update(window, errors)
    values = np.random.default_rng(1).normal(size=64)
    chosen, weights = importance.draw(window, 400_000, np.random.default_rng(2))
    estimate = (weights * values[chosen - 100]).mean()
    assert estimate == pytest.approx(values.mean(), abs=0.01)
    assert weights.mean() == pytest.approx(1.0, abs=0.01)


def test_weights_are_bounded() -> None:
    importance = Importance(32)
    window = np.arange(32)
    importance.update(window, np.r_[1e9, np.full(31, 1e-9)].astype(np.float32))
    chosen, weights = importance.draw(window, 10_000, np.random.default_rng(0))
    assert weights.max() <= 1 / UNIFORM_SHARE
    assert (chosen == 0).mean() == pytest.approx(1 - UNIFORM_SHARE + UNIFORM_SHARE / 32, abs=0.02)


@pytest.mark.parametrize("errors", [None, 0.0])
def test_without_errors_all_are_alike(errors: float | None) -> None:
    importance = Importance(16)
    window = np.arange(16)
    if errors is not None:
        importance.update(window, np.full(16, errors, np.float32))
    _, weights = importance.draw(window, 100, np.random.default_rng(0))
    np.testing.assert_allclose(weights, 1.0)


def test_a_sample_that_took_anothers_place_is_unknown() -> None:
    importance = Importance(4)
    importance.update(np.array([0, 1, 2, 3]), np.array([9.0, 1.0, 1.0, 1.0], np.float32))
    chosen, _ = importance.draw(np.arange(1, 5), 40_000, np.random.default_rng(0))
    # Sample 4 took the place of sample 0, whose high error is not its own.
    assert np.bincount(chosen, minlength=5)[4] == pytest.approx(10_000, rel=0.05)
