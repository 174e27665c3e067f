"""The paper's runs by hand: 30 passes over 200,000 images in each of two stages."""

from __future__ import annotations

import pytest

from model.training.epochs import halvings_of_epochs, samples_of_epochs
from model.training.optimizers import halving_decay
from model.training.options import TrainingOptions


def test_the_papers_run_sees_each_image_thirty_times_in_each_stage() -> None:
    assert samples_of_epochs(30, 200_000, TrainingOptions.faithful()) == 2 * 30 * 200_000
    assert samples_of_epochs(1, 500, TrainingOptions()) == 500
    assert samples_of_epochs(0.001, 10, TrainingOptions.faithful()) == 1


@pytest.mark.parametrize("epochs", [30.0, 12.0])
def test_rates_halve_every_five_and_eight_passes_however_many_there_are(epochs: float) -> None:
    options = TrainingOptions.faithful().with_settings(halvings_of_epochs(epochs))
    for done in range(int(epochs)):
        # In the middle of a pass, so that rounding decides nothing.
        progress = (done + 0.5) / epochs
        assert halving_decay(progress, options.opacity.halvings) == 0.5 ** (done // 5)
        assert halving_decay(progress, options.translation.halvings) == 0.5 ** (done // 8)


def test_the_papers_recipe_is_whole() -> None:
    options = TrainingOptions.faithful().with_settings(halvings_of_epochs(30))
    assert options == TrainingOptions.faithful()
    assert (options.opacity.batch_size, options.translation.batch_size) == (64, 50)
    assert options.opacity_time_share == 0.5
