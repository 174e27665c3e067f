"""The real pipeline on a small volume: whole runs, their budgets and their troubles."""

from __future__ import annotations

import csv
import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import safetensors
import torch
from skimage.io import imread
from training_runs import RECIPE, Stop, plan

from model.errors import CollapseError, DatasetError, TrainingError
from model.networks.card import load_card
from model.networks.checkpoint import load_model
from model.networks.codec import LatentCodec
from model.samples.sample_store import SampleStore
from model.samples.sampling import Split
from model.scene.scene import Scene
from model.training import trainer
from model.training.batch import EncodedBatch
from model.training.options import Budget
from model.training.plan import TrainingReport
from model.training.stage import StepResult
from model.training.stages import OpacityStage
from model.training.state import STATE_FILE, load_progress
from model.training.trainer import train


def test_a_run_leaves_a_model_a_curve_and_pictures(finished: Path, store: SampleStore) -> None:
    card, network = load_model(finished)
    assert card.scene == store.scene
    assert card.training["samples_seen"] == 320
    assert set(card.metrics["holdout"]) == {"tf_rmse", "opacity_rmse", "rmse", "emd"}
    assert card.versions["torch"].startswith("2.")
    assert not network.training
    with (finished / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["stage"] for row in rows] == ["opacity"] * 8 + ["translation"] * 12
    assert float(rows[-1]["rmse"]) == pytest.approx(card.metrics["holdout"]["rmse"], abs=1e-6)
    sheet = imread(sorted((finished / "sheets").glob("*.png"))[-1])
    assert sheet.shape == (4 * 64, 8 * 64, 3)
    truth = store.read("holdout", range(1)).rgba[0, ..., :3]
    assert np.abs(sheet[:64, :64].astype(int) - truth).max() <= 1


def test_the_curve_in_the_card_is_the_logs(finished: Path) -> None:
    curve = load_card(finished).training["curve"]
    assert len(curve) == 20
    assert curve[-1]["samples"] == 320


@pytest.mark.slow
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
    with pytest.raises(TrainingError, match="codes of all opacity TFs are the same"):
        train(plan(store, tmp_path), on_report=seen.append)
    assert load_progress(tmp_path)[0].samples == 6 * 16


@pytest.mark.parametrize("end", [pytest.param("of the stage", marks=pytest.mark.slow), "by Ctrl-C"])
def test_what_has_just_collapsed_never_replaces_what_was_good(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, end: str
) -> None:
    monkeypatch.setattr("model.training.guard.WARM_UP", 0)
    monkeypatch.setattr("model.training.guard.LEAST_DIVERSITY", 0)
    last = 8 if end == "of the stage" else 5
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


@pytest.mark.parametrize(("samples", "holdout"), [(3, 8), (64, 1)])
def test_too_few_samples_are_refused(
    scene: Scene, tmp_path: Path, samples: int, holdout: int
) -> None:
    counts: dict[Split, int] = {"train": samples, "holdout": holdout}
    store = SampleStore.create(tmp_path / "few.zarr", scene, 0, counts)
    with pytest.raises(DatasetError, match="too few"):
        train(plan(store, tmp_path / "run"))


@pytest.mark.slow
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


def test_a_run_is_saved_soon_after_it_has_begun(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trainer, "FIRST_SAVE_S", 0.0)
    saved: list[bool] = []

    def note(_report: TrainingReport) -> None:
        saved.append((tmp_path / "run" / STATE_FILE).exists())

    train(plan(store, tmp_path / "run", samples=160, interval=1e9), on_report=note)
    # A report comes before the save of its own step.
    assert saved[:2] == [False, True]


def test_a_full_disk_is_said_at_the_start(
    store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=1000))
    reports: list[TrainingReport] = []
    with pytest.raises(TrainingError, match="0 MB are free; make room"):
        train(plan(store, tmp_path / "run"), on_report=reports.append)
    assert not reports
