"""Runs of a few seconds that the tests of training look at."""

import shutil
from pathlib import Path

import pytest
from training_runs import Stop, plan

from model.training.trainer import train


@pytest.fixture(scope="session", autouse=True)
def few_probes():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("model.training.monitor.PROBE_SAMPLES", 8)
        yield


@pytest.fixture(scope="session")
def finished(store, tmp_path_factory):
    """A run of 160 samples: 4 steps of stage 1 and 6 of stage 2. Only to be looked at."""
    folder = tmp_path_factory.mktemp("runs") / "finished"
    train(plan(store, folder))
    return folder


@pytest.fixture(scope="session")
def interrupted(store, tmp_path_factory):
    """That run, stopped after 2 steps. Only to be looked at."""
    folder = tmp_path_factory.mktemp("runs") / "interrupted"
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, folder), on_report=Stop(2))
    return folder


@pytest.fixture
def stopped(interrupted, tmp_path):
    """A copy of it, to be gone on with."""
    return Path(shutil.copytree(interrupted, tmp_path / "stopped"))
