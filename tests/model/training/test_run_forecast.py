"""The forecast of a run beside the run itself, as a ratio: it says an order, not seconds."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
import torch

from model.scene.volume import Volume
from model.training import run_forecast
from model.training.execution import Execution
from model.training.job import TrainingJob


def test_a_forecast_grows_with_the_samples_and_counts_both_stages(
    volume: Volume, monkeypatch
) -> None:
    timed: list[tuple[str, int]] = []

    def steps(size, options, scene, device, execution, stage):
        batch = getattr(options, stage).batch_size
        timed.append((stage, batch))
        while True:
            yield {"opacity": 2.0, "translation": 6.0}[stage]

    monkeypatch.setattr(run_forecast, "step_seconds", steps)
    monkeypatch.setattr(run_forecast, "_rendering_seconds", lambda scene, volume: 0.5)
    device, execution = torch.device("cpu"), Execution("float32")
    seconds = []
    for samples in (1000, 3000):
        job = TrainingJob(
            Path("x"), preset="draft", faithful=True, samples=samples, workers=2, reuse=10.0
        )
        seconds.append(run_forecast.forecast_run(job, volume, device, execution))
    assert timed[:2] == [("opacity", 16), ("translation", 16)]
    # Half of the samples in each stage, sixteen a step; a tenth rendered by two threads.
    assert seconds[0] == 500 / 16 * 2 + 500 / 16 * 6 + 1000 / 10 * 0.5 / 2
    assert seconds[1] == 3 * seconds[0]


def test_a_rough_forecast_takes_one_step_of_each_stage(volume: Volume, monkeypatch) -> None:
    def steps(*arguments: object):
        yield 3.0
        pytest.fail("a second step was timed")

    monkeypatch.setattr(run_forecast, "step_seconds", steps)
    monkeypatch.setattr(run_forecast, "_rendering_seconds", lambda scene, volume: 0.0)
    job = TrainingJob(Path("x"), preset="draft", faithful=True, samples=1600)
    rough = run_forecast.forecast_run(job, volume, torch.device("cpu"), Execution(), rough=True)
    assert rough == 1600 / 16 * 3.0


@pytest.mark.slow
def test_a_forecast_takes_seconds(volume: Volume) -> None:
    job = TrainingJob(Path("x"), preset="draft", faithful=True, samples=10**6)
    start = time.monotonic()
    seconds = run_forecast.forecast_run(job, volume, torch.device("cpu"), Execution("float32"))
    assert seconds > time.monotonic() - start
