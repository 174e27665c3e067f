"""Runs that start from a trained model."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from training_runs import RECIPE, Stop, assert_same_state, plan

from model.errors import TrainingError
from model.networks.card import load_card
from model.networks.checkpoint import load_model
from model.samples.sample_store import SampleStore
from model.scene.scene import Scene
from model.training.options import StageOptions, TrainingOptions
from model.training.plan import TrainingPlan
from model.training.schedule import Schedule
from model.training.trainer import train
from model.training.warm_start import WarmStart

ONE_STAGE = replace(RECIPE, one_stage=True, small_time_share=0.0)


def from_there(store: SampleStore, finished: Path, folder: Path) -> TrainingPlan:
    return replace(plan(store, folder, 320), start=WarmStart.read(finished))


@pytest.mark.parametrize("options", [RECIPE, ONE_STAGE])
def test_the_first_weights_are_the_models(
    store: SampleStore, finished: Path, options: TrainingOptions
) -> None:
    start = WarmStart.read(finished)
    schedule = Schedule(start.card.size, options, store.scene, torch.device("cpu"))
    schedule.start_from(start.network)
    trained = load_model(finished)[1].state_dict()
    averaged = schedule.generator().state_dict()
    assert averaged.keys() == trained.keys()
    assert all(torch.equal(value, trained[name]) for name, value in averaged.items())
    for name, stage in schedule.stages.items():
        prefix = "" if name == "joint" else name + "."
        for key, value in stage.generator.state_dict().items():
            assert torch.equal(value, trained[prefix + key])


def test_a_run_begins_where_the_model_was(
    store: SampleStore, finished: Path, tmp_path: Path
) -> None:
    # One step at a rate that changes next to nothing measures the first weights.
    still = StageOptions(16, 1e-9, 1.0)
    options = replace(ONE_STAGE, joint=still)
    for name, start in (("anew", None), ("on", WarmStart.read(finished))):
        train(replace(plan(store, tmp_path / name, 16), options=options, start=start))
    anew, on = (load_card(tmp_path / name).metrics["holdout"] for name in ("anew", "on"))
    before = load_card(finished).metrics["holdout"]
    assert on["rmse"] == pytest.approx(before["rmse"], rel=0.03)
    assert on["tf_rmse"] == pytest.approx(before["tf_rmse"], rel=0.01)
    assert anew["rmse"] > 1.05 * before["rmse"]
    assert anew["tf_rmse"] != pytest.approx(before["tf_rmse"], rel=0.03)


@pytest.mark.slow
def test_the_card_remembers_the_earlier_run(
    store: SampleStore, finished: Path, tmp_path: Path
) -> None:
    train(from_there(store, finished, tmp_path / "run"))
    card, earlier = load_card(tmp_path / "run"), load_card(finished)
    assert card.training["start"] == earlier.training
    assert card.training["samples_seen"] == 320


@pytest.mark.slow
def test_such_a_run_resumes_from_the_same_model_only(
    store: SampleStore, finished: Path, tmp_path: Path
) -> None:
    whole, folder = tmp_path / "whole", tmp_path / "run"
    train(from_there(store, finished, whole))
    asked = from_there(store, finished, folder)
    with pytest.raises(KeyboardInterrupt):
        train(asked, on_report=Stop(9))
    with pytest.raises(TrainingError, match=r"start \w{64}, not None"):
        train(replace(asked, start=None), resume=True)
    with pytest.raises(TrainingError, match="start "):
        train(replace(asked, start=WarmStart.read(whole)), resume=True)
    train(asked, resume=True)
    assert_same_state(folder, whole)


def test_a_model_of_another_network_or_scene_is_refused(store: SampleStore, finished: Path) -> None:
    start = WarmStart.read(finished)
    scene = store.scene
    start.check(start.card.size, scene)
    start.check(start.card.size, replace(scene, volume_name="another", volume_fingerprint="1"))
    wider = replace(start.card.size, width=0.25)
    with pytest.raises(TrainingError, match=r"width \(0\.125, not 0\.25\)"):
        start.check(wider, scene)
    longer = Scene.from_json(json.loads(json.dumps(scene.to_json())) | {"proportions": [1, 1, 0.5]})
    with pytest.raises(TrainingError, match="proportions"):
        start.check(start.card.size, longer)
