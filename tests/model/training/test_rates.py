"""Learning rates, and the paper's: 30 passes over 200,000 images in each of two stages."""

import numpy as np
import pytest
import torch
from torch import nn

from model.training.optimizers import cosine_decay, halving_decay
from model.training.options import TrainingOptions, halvings_of_epochs, samples_of_epochs


def test_the_papers_run_sees_each_image_thirty_times_in_each_stage():
    assert samples_of_epochs(30, 200_000, TrainingOptions.faithful()) == 2 * 30 * 200_000
    assert samples_of_epochs(1, 500, TrainingOptions()) == 500
    assert samples_of_epochs(0.001, 10, TrainingOptions.faithful()) == 1


@pytest.mark.parametrize("epochs", [30.0, 12.0])
def test_rates_halve_every_five_and_eight_passes_however_many_there_are(epochs):
    options = TrainingOptions.faithful().with_settings(halvings_of_epochs(epochs))
    assert epochs != 30 or options == TrainingOptions.faithful()
    for done in range(int(epochs)):
        # In the middle of a pass, so that rounding decides nothing.
        progress = (done + 0.5) / epochs
        assert halving_decay(progress, options.opacity.halvings) == 0.5 ** (done // 5)
        assert halving_decay(progress, options.translation.halvings) == 0.5 ** (done // 8)


def test_the_cosine_rises_and_falls_like_torchs_own_schedules():
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
    assert all(0 < cosine_decay(progress) <= 1 for progress in (0.0, 0.5, 1.0, 7.0))
