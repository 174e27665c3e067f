import numpy as np
import pytest
import torch
from torch import nn

from model.training.optimizers import cosine_decay, halving_decay


def test_the_cosine_rises_and_falls_like_torchs_own_schedules() -> None:
    steps = 1000
    weight = nn.Parameter(torch.zeros(1))
    optimizer = torch.optim.SGD([weight], lr=1.0)
    warm = int(0.03 * steps)
    schedule = torch.optim.lr_scheduler.SequentialLR(
        optimizer,
        [
            torch.optim.lr_scheduler.LinearLR(optimizer, 1e-9, 1.0, warm),
            torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps - warm),
        ],
        [warm],
    )
    expected = []
    for _ in range(steps):
        expected.append(optimizer.param_groups[0]["lr"])
        optimizer.step()
        schedule.step()
    ours = [cosine_decay(step / steps) for step in range(steps)]
    np.testing.assert_allclose(ours, expected, atol=1.1e-3)


@pytest.mark.parametrize("progress", [0.0, 0.5, 1.0, 7.0])
def test_rates_stay_above_zero_and_at_most_one(progress: float) -> None:
    assert 0 < cosine_decay(progress) <= 1


def test_halvings() -> None:
    assert [halving_decay(p, 4) for p in (0, 0.24, 0.25, 0.99)] == [1, 1, 0.5, 0.125]
