from __future__ import annotations

import pytest

from app.state.exactness import STEPS, step_for
from model.errors import TfscopeError


@pytest.mark.parametrize(
    ("budget_ms", "error", "step"),
    [
        (None, None, None),
        (15.0, None, 0),
        (39.0, None, 0),
        (40.0, None, 1),
        (1000.0, None, 4),
        (None, 1.0, 0),
        (None, 0.005, 2),
        (None, 0.001, 4),
        # The finest within the time, which is at least as good as asked for.
        (150.0, 0.006, 3),
    ],
)
def test_the_step_keeps_to_time_and_error(
    budget_ms: float | None, error: float | None, step: int | None
) -> None:
    assert step_for(budget_ms, error) == step
    if step is not None:
        assert budget_ms is None or 1e3 * STEPS[step].live_seconds <= budget_ms
        assert error is None or STEPS[step].error <= error


@pytest.mark.parametrize(
    ("budget_ms", "error", "words"),
    [
        (5.0, None, "give 15 or more"),
        (None, 0.0001, "give 0.001 or more"),
        (40.0, 0.001, "goes with 200 ms"),
    ],
)
def test_what_no_step_keeps_to_is_refused(
    budget_ms: float | None, error: float | None, words: str
) -> None:
    with pytest.raises(TfscopeError, match=words):
        step_for(budget_ms, error)
