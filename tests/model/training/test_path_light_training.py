"""Training of the network behind the denoiser, on pictures whose error is known."""

from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from model.errors import TrainingError
from model.networks.path_light_network import PathLightSize
from model.samples.path_light_pairs import FEW, Pairs
from model.training import path_light_training
from model.training.path_light_training import PathLightOptions, PathLightTrainer, path_light_errors

CPU = torch.device("cpu")


def too_dark(count=6, seed=0):
    """Pairs whose denoised pictures have nine tenths of the light, and whose truth is noisy."""
    rng = np.random.default_rng(seed)
    exact = rng.uniform(0.2, 0.8, (count, 3, 1, 1)) * np.ones((count, 3, 32, 32))
    noisy = exact + rng.normal(0, 0.05, exact.shape)
    few = np.repeat(0.9 * exact[:, None], len(FEW), 1).astype(np.float16)
    half, one = exact.astype(np.float16), np.ones((count, 1, 32, 32), np.float16)
    return Pairs(half, half, one, few, few, noisy.astype(np.float16), np.full(count, 0.05))


def make(minutes=0.1):
    torch.manual_seed(0)
    options = PathLightOptions(minutes, PathLightSize(8), averaging=0.9, learning_rate=5e-3)
    return PathLightTrainer({"a": too_dark()}, options, CPU)


def test_errors_are_those_of_the_pictures_without_the_truths_noise():
    pairs = too_dark(count=4)
    first, *_ = path_light_errors(make().network, {"a": pairs}, CPU)
    exact = pairs.denoised[:, 0].astype(float) / 0.9
    right = np.sqrt(np.mean((0.1 * exact) ** 2, (1, 2, 3))).mean()
    assert first.denoised["a"] == pytest.approx(right, rel=0.1)
    # Untrained, it changes nothing.
    assert first.finished == pytest.approx(first.denoised, rel=1e-3)


@pytest.mark.slow
def test_it_learns_what_is_missing_on_pictures_that_it_has_not_seen():
    trainer = make()
    trainer.run()
    for each in path_light_errors(trainer.network, {"b": too_dark(4, seed=9)}, CPU):
        denoised, finished = each.means
        assert finished < 0.6 * denoised


def test_a_stopped_training_goes_on(tmp_path, monkeypatch):
    # Each step takes a second.
    monkeypatch.setattr(path_light_training, "time", SimpleNamespace(perf_counter=count().__next__))
    monkeypatch.setattr(path_light_training, "REPORT_STEPS", 2)
    trainer, losses = make(4 / 60), []
    trainer.run(losses.append, tmp_path / "a.training")
    assert len(losses) == 2
    again = make(6 / 60)
    again.resume(tmp_path / "a.training")
    assert (again.steps, again.seconds) == (trainer.steps, trainer.seconds)
    for mine, kept in zip(again.network.parameters(), trainer.network.parameters(), strict=True):
        torch.testing.assert_close(mine, kept)
    again.run()
    assert (trainer.steps, again.steps) == (4, 6)


def test_a_checkpoint_of_another_network_is_reported(tmp_path):
    torch.save({"network": {}}, tmp_path / "a.training")
    with pytest.raises(TrainingError, match="delete it"):
        make().resume(tmp_path / "a.training")
    with pytest.raises(TrainingError, match="no pairs"):
        PathLightTrainer({}, PathLightOptions(1.0), CPU)
