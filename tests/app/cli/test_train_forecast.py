"""What ``train`` says of a long run's time, and when."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.cli import train
from model.training import run_forecast
from model.training.execution import Execution
from model.training.job import TrainingJob

FASTEST = Execution("float32")


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is said, and "choosing" where the fastest way of computing begins to be measured."""
    said: list[str] = []

    def run(job, show, say) -> None:
        said.append("choosing")
        say(FASTEST)

    def forecast(job, volume, device, execution, rough=False) -> float:
        return 3 * 86400.0 if rough else 5 * 86400.0

    monkeypatch.setattr(train, "run_job", run)
    monkeypatch.setattr(run_forecast, "forecast_run", forecast)
    monkeypatch.setattr(train.console, "print", lambda *texts: said.extend(map(str, texts)))
    return said


def test_a_long_runs_time_is_said_before_ways_are_measured_and_again_after(
    said: list[str],
) -> None:
    train._run_with_bar(TrainingJob(Path("x"), faithful=True, samples=12_000_000))
    at = said.index("choosing")
    assert "12,000,000 samples takes about 3 days" in "".join(said[:at])
    assert "12,000,000 samples takes about 5 days" in "".join(said[at:])


def test_a_short_run_begins_at_once(said: list[str]) -> None:
    train._run_with_bar(TrainingJob(Path("x"), samples=train.LONG_RUN - 1))
    assert said[0] == "choosing"
    assert not any("takes" in text for text in said)
