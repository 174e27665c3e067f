"""Runs of the paper's networks whose images grow."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from skimage.measure import block_reduce
from training_runs import RECIPE, SIZE, Stop, assert_same_state, plan

from model.networks.card import load_card
from model.networks.checkpoint import load_model
from model.samples.sample_store import SampleBatch, SampleStore
from model.training.options import Budget, StageOptions
from model.training.plan import TrainingPlan
from model.training.schedule import Schedule
from model.training.sources import reduced
from model.training.trainer import train
from model.training.warm_start import WarmStart

GROWING = replace(RECIPE, one_stage=True, small=StageOptions(16, 1e-3, 2.0), adversarial_start=0.0)


def growing(store: SampleStore, folder: Path) -> TrainingPlan:
    return replace(plan(store, folder, 160, 1e9), options=GROWING)


def test_images_are_averaged_over_blocks() -> None:
    rng = np.random.default_rng(0)
    rgba = rng.integers(0, 256, (2, 8, 8, 4), dtype=np.uint8)
    small = reduced(SampleBatch({}, rgba), 4)
    expected = block_reduce(rgba.astype(np.float64), (1, 2, 2, 1), np.mean)
    assert small.rgba.shape == (2, 4, 4, 4)
    assert np.abs(small.rgba - expected).max() <= 0.5


def test_a_run_learns_small_images_first_and_then_grows(store: SampleStore, tmp_path: Path) -> None:
    reports = []
    train(growing(store, tmp_path), on_report=reports.append)
    assert list(dict.fromkeys(r.stage for r in reports)) == ["small", "joint"]
    # The discriminator joins at the full size only.
    assert all(("discriminator" in r.losses) == (r.stage == "joint") for r in reports)
    card = load_card(tmp_path)
    assert card.size.image_size == SIZE.image_size
    assert {row["stage"] for row in card.training["curve"]} == {"small", "joint"}


def test_what_was_learned_at_the_small_size_is_kept(store: SampleStore) -> None:
    torch.manual_seed(5)
    schedule = Schedule(SIZE, GROWING, store.scene, torch.device("cpu"))
    small, joint = schedule.stages["small"], schedule.stages["joint"]
    trained = small.average.network
    for parameter in trained.parameters():
        parameter.data.add_(torch.randn_like(parameter))
    schedule.enter("joint")
    own, theirs = joint.generator.state_dict(), trained.state_dict()
    kept = [n for n in own if n in theirs and own[n].shape == theirs[n].shape]
    assert all(torch.equal(own[name], theirs[name]) for name in kept)
    new = {name.split(".")[1] for name in own.keys() - set(kept)}
    assert new <= {"paint", "color"}
    assert len(kept) > 0.85 * len(own)


@pytest.mark.slow
@pytest.mark.parametrize("steps", [3, 7])
def test_such_a_run_resumes_in_either_stage(store: SampleStore, tmp_path: Path, steps: int) -> None:
    whole, folder = tmp_path / "whole", tmp_path / "run"
    train(growing(store, whole))
    with pytest.raises(KeyboardInterrupt):
        train(growing(store, folder), on_report=Stop(steps))
    train(growing(store, folder), resume=True)
    assert_same_state(folder, whole)


def test_a_model_of_small_images_is_a_start_for_larger_ones(
    store: SampleStore, tmp_path: Path
) -> None:
    small = replace(SIZE, image_size=16)
    scene = replace(store.scene, image_size=16)
    first = Schedule(small, GROWING, scene, torch.device("cpu"))
    assert first.names == ["joint"]
    start = WarmStart("0", replace(_card(store, tmp_path), size=small), first.generator())
    start.check(SIZE, store.scene)
    schedule = Schedule(SIZE, GROWING, store.scene, torch.device("cpu"))
    schedule.start_from(start.network)
    assert schedule.names == ["joint"]
    weights = schedule.generator().state_dict()
    for name, value in start.network.state_dict().items():
        if name.startswith(("opacity.", "translation.fusion", "translation.decoder")):
            assert torch.equal(weights[name], value), name


def _card(store: SampleStore, folder: Path):  # type: ignore[no-untyped-def]
    options = replace(GROWING, small_time_share=0.0)
    train(replace(plan(store, folder), options=options, budget=Budget(samples=16)))
    return load_model(folder)[0]


def test_features_are_matched_once_the_discriminator_has_joined(
    store: SampleStore, tmp_path: Path
) -> None:
    options = replace(
        GROWING, small_time_share=0.0, adversarial_start=0.5, feature_matching_weight=10.0
    )
    reports = []
    asked = replace(plan(store, tmp_path, 64), options=options)
    train(asked, on_report=reports.append)
    found = ["feature_matching" in report.losses for report in reports]
    assert found == [False, False, True, True]
    assert reports[-1].losses["feature_matching"] > 0
