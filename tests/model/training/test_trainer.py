"""The real pipeline on a small volume: whole runs, kills and resumptions."""

from __future__ import annotations

import csv
import itertools
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pytest
import safetensors
import torch
from safetensors.torch import load_file
from skimage.io import imread

from model.checkpoint import load_card, load_model
from model.dataset import SampleStore
from model.encoding import EncodedBatch
from model.errors import CollapseError, DatasetError, TrainingError
from model.networks.blocks import Architecture, NetworkSize
from model.networks.opacity import LatentCodec
from model.sample_rendering import render_store
from model.sampling import Stream
from model.scene import Scene
from model.training.joint import JointStage
from model.training.options import Budget, StageOptions, TrainingOptions
from model.training.plan import TrainingPlan, TrainingReport
from model.training.sources import StoredSource
from model.training.stage import StepResult
from model.training.stages import OpacityStage
from model.training.state import load_progress
from model.training.stream import StreamSource
from model.training.trainer import train
from model.volume import Volume

SIZE = NetworkSize(0.125, 16, 64)
RECIPE = TrainingOptions(
    opacity=StageOptions(16, 2e-4, 6.0),
    translation=StageOptions(16, 8e-5, 3.75),
    joint=StageOptions(16, 1e-3, 2.0),
    one_stage=False,
    seed=3,
)


def plan(
    store: SampleStore, folder: Path, samples: int = 640, interval: float = 0.0
) -> TrainingPlan:
    return TrainingPlan(
        source=StoredSource(store),
        preset="draft",
        size=SIZE,
        options=RECIPE,
        budget=Budget(samples=samples),
        folder=folder,
        device=torch.device("cpu"),
        interval=interval,
    )


class Stop:
    """Presses Ctrl-C after so many steps."""

    def __init__(self, steps: int) -> None:
        self.left = steps

    def __call__(self, report: TrainingReport) -> None:
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt


def assert_same_state(one: Path, other: Path) -> None:
    """All networks, averages and optimisers of two finished runs, to the last bit."""
    states = [load_file(next(folder.glob("training-*.safetensors"))) for folder in (one, other)]
    assert states[0].keys() == states[1].keys()
    for name, value in states[0].items():
        assert torch.equal(value, states[1][name]), name


@pytest.fixture(scope="module", autouse=True)
def few_probes() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("model.training.progress.PROBE_SAMPLES", 8)
        yield


@pytest.fixture(scope="module")
def finished(store: SampleStore, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 640 samples: 16 steps of stage 1 and 24 of stage 2."""
    folder = tmp_path_factory.mktemp("runs") / "finished"
    train(plan(store, folder))
    return folder


def test_a_run_leaves_a_model_a_curve_and_pictures(finished: Path, store: SampleStore) -> None:
    card, network = load_model(finished)
    assert card.scene == store.scene
    assert card.training["samples_seen"] == 640
    assert set(card.metrics["holdout"]) == {"tf_rmse", "opacity_rmse", "rmse", "emd"}
    assert card.versions["torch"].startswith("2.")
    assert not network.training
    with (finished / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["stage"] for row in rows] == ["opacity"] * 16 + ["translation"] * 24
    assert float(rows[-1]["rmse"]) == pytest.approx(card.metrics["holdout"]["rmse"], abs=1e-6)
    sheet = imread(sorted((finished / "sheets").glob("*.png"))[-1])
    assert sheet.shape == (4 * 64, 8 * 64, 3)
    truth = store.read("holdout", range(1)).rgba[0, ..., :3]
    assert np.abs(sheet[:64, :64].astype(int) - truth).max() <= 1


def test_the_curve_in_the_card_is_the_logs(finished: Path) -> None:
    curve = load_card(finished).training["curve"]
    assert len(curve) == 40
    assert curve[-1]["samples"] == 640


@pytest.mark.parametrize("steps", [7, 16, 30])
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
    options = replace(RECIPE, one_stage=True, adversarial_start=0.0)
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


def test_the_same_seed_gives_the_same_run_and_another_another(
    finished: Path, store: SampleStore, tmp_path: Path
) -> None:
    train(plan(store, tmp_path / "same"))
    other = plan(store, tmp_path / "other")
    train(replace(other, options=replace(RECIPE, seed=4)))
    first, same, another = (
        load_model(folder)[1].opacity.encoder[1].weight
        for folder in (finished, tmp_path / "same", tmp_path / "other")
    )
    assert torch.equal(first, same)
    assert not torch.equal(first, another)


KILLED = """
import sys
from pathlib import Path
sys.path.insert(0, "tests/model/training")
from model.dataset import SampleStore
from model.training.trainer import train
import model.training.progress
model.training.progress.PROBE_SAMPLES = 8
from test_trainer import plan
store, folder = SampleStore(Path(sys.argv[1])), Path(sys.argv[2])
train(plan(store, folder), on_report=lambda r: print(r.samples, flush=True))
"""


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
    while int(process.stdout.readline()) < 400:
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
    assert first[0] >= 400
    assert_same_state(folder, finished)


def test_states_are_written_at_intervals_only(store: SampleStore, tmp_path: Path) -> None:
    train(plan(store, tmp_path, samples=320, interval=3600.0))
    with (tmp_path / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    # The end of each stage is always recorded.
    assert [row["stage"] for row in rows] == ["opacity", "translation"]


def test_a_budget_in_minutes_ends_in_time(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ticks = itertools.count()
    clock = SimpleNamespace(monotonic=lambda: 0.25 * next(ticks))
    monkeypatch.setattr("model.training.trainer.time", clock)
    reports: list[TrainingReport] = []
    timed = replace(plan(store, tmp_path, interval=1e9), budget=Budget(minutes=0.1))
    train(timed, on_report=reports.append)
    seconds = [r.seconds for r in reports]
    steps = np.diff(seconds)
    # Each step takes the fake clock's ticks; the last one of a stage may pass its end.
    assert 6.0 <= seconds[-1] <= 6.0 + steps.max()
    first = max(r.seconds for r in reports if r.stage == "opacity")
    assert 0.4 * 6.0 <= first <= 0.4 * 6.0 + steps.max()


def test_even_a_tiny_budget_leaves_a_model(store: SampleStore, tmp_path: Path) -> None:
    train(plan(store, tmp_path, samples=1))
    assert load_card(tmp_path).training["samples_seen"] == 32


def test_a_longer_budget_can_be_given_on_resuming(store: SampleStore, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, tmp_path, samples=320), on_report=Stop(10))
    reports: list[TrainingReport] = []
    train(plan(store, tmp_path, samples=640), resume=True, on_report=reports.append)
    assert reports[-1].samples == 640
    # The metrics of the first session are still known before the second has measured.
    assert set(reports[0].metrics) == {"tf_rmse", "opacity_rmse", "rmse", "emd"}


def test_a_curve_cut_in_the_middle_is_never_seen(finished: Path) -> None:
    assert not list(finished.rglob("*.partial"))


def test_an_unwritable_folder_is_said(store: SampleStore, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(TrainingError, match="cannot be written"):
        train(plan(store, tmp_path / "file" / "run"))


def test_two_runs_never_share_a_folder(store: SampleStore, tmp_path: Path) -> None:
    def start_another(report: TrainingReport) -> None:
        with pytest.raises(TrainingError, match="another process is training there"):
            train(plan(store, tmp_path), resume=True)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(plan(store, tmp_path), on_report=start_another)
    # What was stopped is free again.
    train(plan(store, tmp_path, samples=64), resume=True)


def test_what_cannot_be_resumed_is_said(finished: Path, store: SampleStore, tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="add --resume"):
        train(plan(store, finished))
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


def test_a_loss_that_is_not_finite_stops_the_run(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "model.training.stages.OpacityStage.step",
        lambda *_: StepResult({"opacity_l1": float("nan")}, 1.0),
    )
    with pytest.raises(TrainingError, match="no longer finite"):
        train(plan(store, tmp_path))


def test_a_gradient_that_is_not_finite_changes_nothing_and_stops_the_run(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    error = OpacityStage._generator_losses
    calls = itertools.count()

    def overflow(self: OpacityStage, *given: Any) -> dict[str, torch.Tensor]:
        losses = error(self, *given)
        if next(calls) == 5:
            # Finite itself, but its slope is not.
            losses["opacity_l1"] = (
                losses["opacity_l1"] + (given[1] - given[1]).square().sum().sqrt()
            )
        return losses

    monkeypatch.setattr(OpacityStage, "_generator_losses", overflow)
    with pytest.raises(TrainingError, match=r"after 80 samples: the gradient.*last good state"):
        train(plan(store, tmp_path))
    with safetensors.safe_open(next(tmp_path.glob("training-*.safetensors")), "pt") as file:
        assert all(torch.isfinite(file.get_tensor(key)).all() for key in file.keys())  # noqa: SIM118


def test_a_collapse_stops_the_run_and_keeps_the_last_good_state(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("model.training.guard.WARM_UP", 0)
    # A network of a few steps draws grey images whatever the code.
    monkeypatch.setattr("model.training.guard.LEAST_DIVERSITY", 0)
    encode = LatentCodec.encode
    seen: list[TrainingReport] = []

    def collapsing(self: LatentCodec, opacity_tf: torch.Tensor) -> torch.Tensor:
        latent = encode(self, opacity_tf)
        return latent if len(seen) < 7 else latent * 0

    monkeypatch.setattr(LatentCodec, "encode", collapsing)
    with pytest.raises(TrainingError, match="codes of all opacity TFs have become the same"):
        train(plan(store, tmp_path), on_report=seen.append)
    assert load_progress(tmp_path)[0].samples == 6 * 16


@pytest.mark.parametrize("end", ["of the stage", "by Ctrl-C"])
def test_what_has_just_collapsed_never_replaces_what_was_good(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, end: str
) -> None:
    monkeypatch.setattr("model.training.guard.WARM_UP", 0)
    monkeypatch.setattr("model.training.guard.LEAST_DIVERSITY", 0)
    last = 16 if end == "of the stage" else 9
    encode = LatentCodec.encode
    seen: list[TrainingReport] = []

    def collapsing(self: LatentCodec, opacity_tf: torch.Tensor) -> torch.Tensor:
        return encode(self, opacity_tf) * (len(seen) < last)

    def note(report: TrainingReport) -> None:
        seen.append(report)
        if end == "by Ctrl-C" and len(seen) == last:
            raise KeyboardInterrupt

    monkeypatch.setattr(LatentCodec, "encode", collapsing)
    with pytest.raises(CollapseError if end == "of the stage" else KeyboardInterrupt):
        train(plan(store, tmp_path), on_report=note)
    assert load_progress(tmp_path)[0].samples == (last - 1) * 16


@pytest.mark.parametrize("architecture", get_args(Architecture))
def test_a_joint_stage_resumes_exactly(
    store: SampleStore, tmp_path: Path, architecture: Architecture
) -> None:
    options = replace(RECIPE, one_stage=True)
    size = replace(SIZE, architecture=architecture)

    def run(folder: Path) -> TrainingPlan:
        return replace(plan(store, folder, 320, 1e9), size=size, options=options)

    train(run(tmp_path / "whole"))
    with (tmp_path / "whole" / "log.csv").open() as file:
        assert [row["stage"] for row in csv.DictReader(file)] == ["joint"]
    folder = tmp_path / "stopped"
    with pytest.raises(KeyboardInterrupt):
        train(run(folder), on_report=Stop(4))
    train(run(folder), resume=True)
    assert_same_state(folder, tmp_path / "whole")


@pytest.mark.parametrize(("samples", "holdout"), [(3, 8), (64, 1)])
def test_too_few_samples_are_refused(
    scene: Scene, tmp_path: Path, samples: int, holdout: int
) -> None:
    counts: dict[Stream, int] = {"train": samples, "holdout": holdout}
    store = SampleStore.create(tmp_path / "few.zarr", scene, 0, counts)
    with pytest.raises(DatasetError, match="too few"):
        train(plan(store, tmp_path / "run"))


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


def test_a_full_memory_is_said_once(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    generate = OpacityStage._generate

    def tight(stage: OpacityStage, batch: EncodedBatch) -> object:
        if len(batch) > 8:
            raise torch.OutOfMemoryError("made up")
        return generate(stage, batch)

    monkeypatch.setattr(OpacityStage, "_generate", tight)
    notices: list[str] = []
    stop = Stop(5)

    def note(report: TrainingReport) -> None:
        notices.append(report.notice)
        stop(report)

    with pytest.raises(KeyboardInterrupt):
        train(plan(store, tmp_path, samples=320), on_report=note)
    # Also what is resumed knows.
    train(plan(store, tmp_path, samples=320), resume=True, on_report=note)
    (notice,) = filter(None, notices)
    assert notice.startswith("The memory is too small for 16 samples at once")
    assert "opacity stage is learned from in 2 parts" in notice
