"""Fixtures of the tests of training."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from training_runs import plan

from model.samples.sample_store import SampleStore
from model.training.trainer import train


@pytest.fixture(scope="module", autouse=True)
def few_probes() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("model.training.monitor.PROBE_SAMPLES", 8)
        yield


@pytest.fixture(scope="session")
def finished(store: SampleStore, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 320 samples: 8 steps of stage 1 and 12 of stage 2. Only to be looked at."""
    folder = tmp_path_factory.mktemp("runs") / "finished"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("model.training.monitor.PROBE_SAMPLES", 8)
        train(plan(store, folder))
    return folder
