"""Runs that are stopped, killed, damaged, and go on."""

from __future__ import annotations

import csv
import itertools
import json
import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
from training_runs import RECIPE, SIZE, Stop, assert_same_state, plan

from model.errors import TrainingError
from model.networks.card import load_card
from model.networks.checkpoint import load_model
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.joint import JointStage
from model.training.options import Budget
from model.training.plan import TrainingPlan, TrainingReport
from model.training.state import load_progress
from model.training.streamed_samples import StreamSource
from model.training.trainer import train


@pytest.mark.parametrize(
    "steps", [pytest.param(3, marks=pytest.mark.slow), 8, pytest.param(15, marks=pytest.mark.slow)]
)
def test_a_resumed_run_equals_an_uninterrupted_one(
    finished: Path, store: SampleStore, tmp_path: Path, steps: int
) -> None:
    folder = tmp_path / "run"
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, folder), on_report=Stop(steps))
    train(plan(store, folder), resume=True)
    assert_same_state(folder, finished)
    curves = [load_card(run).training["curve"] for run in (folder, finished)]
    assert [row.keys() for row in curves[0]] == [row.keys() for row in curves[1]]
    assert all(isinstance(row["rmse"], float) for row in curves[0] if "rmse" in row)
    assert [row["samples"] for row in curves[0]] == [row["samples"] for row in curves[1]]


@pytest.fixture(scope="module")
def adversarial(store: SampleStore, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "adversarial"
    train(against(store, folder))
    return folder


def against(store: SampleStore, folder: Path) -> TrainingPlan:
    """A run in which the discriminator learns from the start."""
    options = replace(RECIPE, one_stage=True, small_time_share=0.0, adversarial_start=0.0)
    return replace(plan(store, folder, 128, 1e9), options=options)


@pytest.mark.parametrize("before", ["_train_discriminator", "_generator_losses", "_weights"])
def test_ctrl_c_in_the_middle_of_a_step_costs_nothing(
    adversarial: Path,
    store: SampleStore,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    before: str,
) -> None:
    work = getattr(JointStage, before)
    calls = itertools.count(1)

    def interrupted(*arguments: Any) -> Any:
        if next(calls) == 4:
            signal.raise_signal(signal.SIGINT)
        return work(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(JointStage, before, interrupted)
        with pytest.raises(KeyboardInterrupt):
            train(against(store, tmp_path))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert load_progress(tmp_path)[0].samples == 4 * 16
    train(against(store, tmp_path), resume=True)
    assert_same_state(tmp_path, adversarial)


def test_ctrl_c_pressed_again_is_heard_at_once(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def impatient(*_: Any) -> dict[str, float]:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("this is never come to")

    monkeypatch.setattr(JointStage, "_weights", impatient)
    with pytest.raises(KeyboardInterrupt):
        train(against(store, tmp_path))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    # What is torn apart is not saved.
    assert not (tmp_path / "training.json").exists()


KILLED = """
import sys
from pathlib import Path
sys.path.insert(0, "tests/model/training")
from model.samples.sample_store import SampleStore
from model.training.trainer import train
import model.training.monitor
model.training.monitor.PROBE_SAMPLES = 8
from training_runs import plan
store, folder = SampleStore(Path(sys.argv[1])), Path(sys.argv[2])
train(plan(store, folder), on_report=lambda r: print(r.samples, flush=True))
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_a_killed_run_loses_at_most_one_interval(
    finished: Path, store: SampleStore, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    script = tmp_path / "train.py"
    script.write_text(KILLED)
    process = subprocess.Popen(
        [sys.executable, str(script), str(store.path), str(folder)],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(Path.cwd())},
        text=True,
    )
    assert process.stdout is not None
    while int(process.stdout.readline()) < 200:
        pass
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    load_model(folder)  # whatever the moment of the kill, the model in the folder is whole
    first: list[int] = []

    def note(report: TrainingReport) -> None:
        first.append(report.samples)

    train(plan(store, folder), resume=True, on_report=note)
    # With an interval of 0 every step is saved: the kill may cost the step in work.
    assert first[0] >= 200
    assert_same_state(folder, finished)


@pytest.mark.slow
def test_a_longer_budget_can_be_given_on_resuming(store: SampleStore, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, tmp_path, samples=320), on_report=Stop(10))
    reports: list[TrainingReport] = []
    train(plan(store, tmp_path, samples=640), resume=True, on_report=reports.append)
    assert reports[-1].samples == 640
    # The metrics of the first session are still known before the second has measured.
    assert set(reports[0].metrics) == {"tf_rmse", "opacity_rmse", "rmse", "emd"}


def test_what_cannot_be_resumed_is_said(finished: Path, store: SampleStore, tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="go on with it") as caught:
        train(plan(store, finished))
    assert caught.value.suggested == {"resume": ""}
    with pytest.raises(TrainingError, match="no training run to resume"):
        train(plan(store, tmp_path), resume=True)
    with pytest.raises(TrainingError, match="is finished"):
        train(plan(store, finished), resume=True)
    other = replace(plan(store, finished), options=replace(RECIPE, seed=5))
    with pytest.raises(TrainingError, match=r"options\.seed 3, not 5"):
        train(other, resume=True)


@pytest.mark.parametrize("damage", ["json", "tensors"])
def test_a_damaged_state_is_said(store: SampleStore, tmp_path: Path, damage: str) -> None:
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, tmp_path), on_report=Stop(2))
    if damage == "json":
        (tmp_path / "training.json").write_text("{")
    else:
        (tensors,) = tmp_path.glob("training-*.safetensors")
        tensors.write_bytes(tensors.read_bytes()[:1000])
    with pytest.raises(TrainingError, match="cannot be resumed"):
        train(plan(store, tmp_path), resume=True)


@pytest.mark.slow
def test_an_only_stage_resumes_exactly(store: SampleStore, tmp_path: Path) -> None:
    options = replace(RECIPE, one_stage=True, small_time_share=0.0)

    def run(folder: Path) -> TrainingPlan:
        return replace(plan(store, folder, 320, 1e9), options=options)

    train(run(tmp_path / "whole"))
    with (tmp_path / "whole" / "log.csv").open() as file:
        assert [row["stage"] for row in csv.DictReader(file)] == ["joint"]
    folder = tmp_path / "stopped"
    with pytest.raises(KeyboardInterrupt):
        train(run(folder), on_report=Stop(4))
    train(run(folder), resume=True)
    assert_same_state(folder, tmp_path / "whole")


def test_a_data_set_that_has_grown_is_another_one(
    volume: Volume, scene: Scene, tmp_path: Path
) -> None:
    path = tmp_path / "samples.zarr"
    for count in (64, 96):
        store = SampleStore.create(path, scene, 0, {"train": count, "holdout": 4})
        render_store(store, volume, 1)
        if count == 64:
            with pytest.raises(KeyboardInterrupt):
                train(plan(store, tmp_path / "run"), on_report=Stop(2))
    with pytest.raises(TrainingError, match="samples_stored 64, not 96"):
        train(plan(store, tmp_path / "run"), resume=True)


def test_a_volumes_name_is_for_people(store: SampleStore, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, tmp_path), on_report=Stop(2))
    renamed = plan(store, tmp_path, samples=64)
    renamed.source.scene = replace(store.scene, volume_name="renamed")
    assert renamed.source.scene == store.scene
    train(renamed, resume=True)


def test_a_recipe_of_an_older_version_is_not_resumed_silently(
    store: SampleStore, tmp_path: Path
) -> None:
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, tmp_path), on_report=Stop(2))
    header = json.loads((tmp_path / "training.json").read_text())
    header["recipe"]["options"]["old_loss"] = 5.0
    (tmp_path / "training.json").write_text(json.dumps(header))
    with pytest.raises(TrainingError, match=r"options\.old_loss 5\.0, not None"):
        train(plan(store, tmp_path), resume=True)


def streamed(volume: Volume, scene: Scene, folder: Path) -> TrainingPlan:
    source = StreamSource(volume, scene, seed=5, reuse=8, threads=1)
    return TrainingPlan(
        source=source,
        preset="draft",
        size=SIZE,
        options=RECIPE,
        budget=Budget(samples=640),
        folder=folder,
        device=torch.device("cpu"),
        interval=1e9,
    )


@pytest.mark.slow
def test_a_run_on_fresh_samples_resumes_exactly(
    volume: Volume, scene: Scene, tmp_path: Path
) -> None:
    scene = replace(scene, renderer="raycast")
    train(streamed(volume, scene, tmp_path / "whole"))
    for steps in (5, 20):
        folder = tmp_path / f"stopped after {steps}"
        with pytest.raises(KeyboardInterrupt):
            train(streamed(volume, scene, folder), on_report=Stop(steps))
        train(streamed(volume, scene, folder), resume=True)
        assert_same_state(folder, tmp_path / "whole")
    card = load_card(tmp_path / "whole")
    assert card.scene == scene
    assert card.training["reuse"] == 8
    assert not [t for t in threading.enumerate() if t.name == "samples"]
