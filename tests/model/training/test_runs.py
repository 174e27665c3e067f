import csv
import itertools
import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import safetensors
import torch
from skimage.io import imread
from skimage.measure import block_reduce
from training_runs import RECIPE, SIZE, Stop, plan

from model.errors import DatasetError, TrainingError
from model.generator.generator import Generator
from model.networks.card import load_card
from model.networks.checkpoint import load_model
from model.networks.generator_network import LatentCodec
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleBatch, SampleStore
from model.samples.sampling import draw_sample
from model.scene.scene import LightDirection, LightRange, Scene
from model.training import trainer
from model.training.options import Budget, StageOptions, TrainingJob
from model.training.plan import WarmStart
from model.training.sources import reduced
from model.training.stages import OpacityStage, Schedule
from model.training.state import STATE_FILE, load_progress
from model.training.trainer import run_job, train
from model.volume_files.source import VolumeSource

CPU = torch.device("cpu")
ONE_STAGE = replace(RECIPE, one_stage=True, small_time_share=0.0)
GROWING = replace(RECIPE, one_stage=True, small=StageOptions(16, 1e-3, 2.0), adversarial_start=0.5)


def test_a_run_leaves_a_model_a_curve_and_pictures(finished, store):
    card, network = load_model(finished)
    assert card.scene == store.scene
    assert card.training["samples_seen"] == 160
    assert set(card.metrics["holdout"]) == {"tf_rmse", "opacity_rmse", "rmse"}
    assert card.versions["torch"].startswith("2.")
    assert not network.training
    with (finished / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["stage"] for row in rows] == ["opacity"] * 4 + ["translation"] * 6
    assert [row["samples"] for row in card.training["curve"]] == list(range(16, 161, 16))
    assert float(rows[-1]["rmse"]) == pytest.approx(card.metrics["holdout"]["rmse"], abs=1e-6)
    sheet = imread(sorted((finished / "sheets").glob("*.png"))[-1])
    assert sheet.shape == (4 * 64, 8 * 64, 3)
    truth = store.read("holdout", range(1)).rgba[0, ..., :3]
    assert np.abs(sheet[:64, :64].astype(int) - truth).max() <= 1
    assert not list(finished.rglob("*.partial"))


def test_a_budget_in_minutes_ends_in_time(store, tmp_path, monkeypatch):
    ticks = itertools.count()
    clock = SimpleNamespace(monotonic=lambda: 0.25 * next(ticks))
    monkeypatch.setattr("model.training.trainer.time", clock)
    reports = []
    timed = replace(plan(store, tmp_path, interval=1e9), budget=Budget(minutes=0.1))
    train(timed, on_report=reports.append)
    seconds = [r.seconds for r in reports]
    steps = np.diff(seconds)
    # Each step takes the fake clock's ticks; the last one of a stage may pass its end.
    assert 6.0 <= seconds[-1] <= 6.0 + steps.max()
    first = max(r.seconds for r in reports if r.stage == "opacity")
    assert 0.4 * 6.0 <= first <= 0.4 * 6.0 + steps.max()
    # Measured at intervals only, and at the end of each stage.
    curve = load_card(tmp_path).training["curve"]
    assert [row["stage"] for row in curve] == ["opacity", "translation"]


def test_even_a_tiny_budget_leaves_a_model_and_is_saved_soon(store, tmp_path, monkeypatch):
    monkeypatch.setattr(trainer, "FIRST_SAVE_S", 0.0)
    saved = []

    def note(_report):
        saved.append((tmp_path / STATE_FILE).exists())

    train(plan(store, tmp_path, samples=1, interval=1e9), on_report=note)
    # A report comes before the save of its own step.
    assert saved == [False, True]
    assert load_card(tmp_path).training["samples_seen"] == 32


def test_what_cannot_begin_is_said(store, scene, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(TrainingError, match="cannot be written"):
        train(plan(store, tmp_path / "file" / "run"))
    for samples, holdout in ((3, 8), (64, 1)):
        counts = {"train": samples, "holdout": holdout}
        few = SampleStore.create(tmp_path / f"{samples}.zarr", scene, 0, counts)
        with pytest.raises(DatasetError, match="too few"):
            train(plan(few, tmp_path / "run"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=1000))
        with pytest.raises(TrainingError, match="0 MB are free; make room"):
            train(plan(store, tmp_path / "run"))


def test_two_runs_never_share_a_folder(store, stopped):
    def start_another(report):
        with pytest.raises(TrainingError, match="another process is training there"):
            train(plan(store, stopped), resume=True)
        raise KeyboardInterrupt

    for _ in range(2):
        # What was stopped is free again.
        with pytest.raises(KeyboardInterrupt):
            train(plan(store, stopped), resume=True, on_report=start_another)


def test_a_gradient_that_is_not_finite_changes_nothing_and_stops_the_run(
    store, stopped, monkeypatch
):
    error = OpacityStage._generator_losses

    def overflow(self, *given):
        losses = error(self, *given)
        # Finite itself, but its slope is not.
        losses["opacity_l1"] = losses["opacity_l1"] + (given[1] - given[1]).square().sum().sqrt()
        return losses

    monkeypatch.setattr(OpacityStage, "_generator_losses", overflow)
    with pytest.raises(TrainingError, match=r"after 32 samples: the gradient.*last good state"):
        train(plan(store, stopped), resume=True)
    with safetensors.safe_open(next(stopped.glob("training-*.safetensors")), "pt") as file:
        assert all(torch.isfinite(file.get_tensor(key)).all() for key in file.keys())  # noqa: SIM118


def test_a_collapse_keeps_the_last_good_state(store, stopped, monkeypatch):
    monkeypatch.setattr("model.training.monitor.WARM_UP", 0)
    # A network of a few steps draws grey images whatever the code.
    monkeypatch.setattr("model.training.monitor.LEAST_DIVERSITY", 0)
    encode = LatentCodec.encode
    seen = []

    def collapsing(self, opacity_tf):
        return encode(self, opacity_tf) * (len(seen) < 2)

    monkeypatch.setattr(LatentCodec, "encode", collapsing)
    with pytest.raises(TrainingError, match="codes of all opacity TFs are the same"):
        train(plan(store, stopped, samples=320), resume=True, on_report=seen.append)
    assert load_progress(stopped)[0].samples == 3 * 16


def test_a_run_learns_small_images_first_and_then_grows(store, tmp_path):
    reports = []
    train(replace(plan(store, tmp_path, 96, 1e9), options=GROWING), on_report=reports.append)
    assert list(dict.fromkeys(r.stage for r in reports)) == ["small", "joint"]
    # The discriminator joins at the full size only, at its time.
    joined = ["discriminator" in r.losses for r in reports]
    assert joined == sorted(joined) and joined[-1]
    assert [r.stage for r, is_joined in zip(reports, joined, strict=True) if is_joined] == ["joint"]
    card = load_card(tmp_path)
    assert card.size.image_size == SIZE.image_size
    assert {row["stage"] for row in card.training["curve"]} == {"small", "joint"}


def test_images_are_averaged_over_blocks():
    rng = np.random.default_rng(0)
    rgba = rng.integers(0, 256, (2, 8, 8, 4), dtype=np.uint8)
    small = reduced(SampleBatch({}, rgba), 4)
    expected = block_reduce(rgba.astype(np.float64), (1, 2, 2, 1), np.mean)
    assert small.rgba.shape == (2, 4, 4, 4)
    assert np.abs(small.rgba - expected).max() <= 0.5


def test_a_model_of_small_images_is_a_start_for_larger_ones(store, finished):
    small = replace(SIZE, image_size=16)
    first = Schedule(small, GROWING, replace(store.scene, image_size=16), CPU)
    assert first.names == ["joint"]
    start = WarmStart("0", replace(load_card(finished), size=small), first.generator())
    start.check(SIZE, store.scene)
    schedule = Schedule(SIZE, GROWING, store.scene, CPU)
    schedule.start_from(start.network)
    assert schedule.names == ["joint"]
    weights = schedule.generator().state_dict()
    for name, value in start.network.state_dict().items():
        if name.startswith(("opacity.", "translation.fusion", "translation.decoder")):
            assert torch.equal(weights[name], value), name


def test_the_first_weights_are_the_models(store, finished):
    start = WarmStart.read(finished)
    schedule = Schedule(start.card.size, RECIPE, store.scene, CPU)
    schedule.start_from(start.network)
    trained = load_model(finished)[1].state_dict()
    averaged = schedule.generator().state_dict()
    assert averaged.keys() == trained.keys()
    assert all(torch.equal(value, trained[name]) for name, value in averaged.items())
    for name, stage in schedule.stages.items():
        for key, value in stage.generator.state_dict().items():
            assert torch.equal(value, trained[f"{name}.{key}"])


def test_such_a_run_begins_there_and_resumes_from_the_same_model_only(store, finished, tmp_path):
    # At a rate that changes next to nothing, the first weights are measured.
    options = replace(ONE_STAGE, joint=StageOptions(16, 1e-9, 1.0))
    run = replace(plan(store, tmp_path, 32), options=options, start=WarmStart.read(finished))
    with pytest.raises(KeyboardInterrupt):
        train(run, on_report=Stop(1))
    for start in (None, replace(run.start, digest="0")):
        with pytest.raises(TrainingError, match="start "):
            train(replace(run, start=start), resume=True)
    train(run, resume=True)
    card, earlier = load_card(tmp_path), load_card(finished)
    assert card.training["start"] == earlier.training
    for name, tolerance in (("rmse", 0.03), ("tf_rmse", 0.01)):
        before = earlier.metrics["holdout"][name]
        assert card.metrics["holdout"][name] == pytest.approx(before, rel=tolerance)


def test_a_model_of_another_network_or_scene_is_refused(store, finished):
    start = WarmStart.read(finished)
    size, scene = start.card.size, store.scene
    start.check(size, replace(scene, volume_name="another", volume_fingerprint="1"))
    with pytest.raises(TrainingError, match=r"width \(0\.125, not 0\.25\)"):
        start.check(replace(size, width=0.25), scene)
    longer = Scene.from_json(json.loads(json.dumps(asdict(scene))) | {"proportions": [1, 1, 0.5]})
    with pytest.raises(TrainingError, match="proportions"):
        start.check(size, longer)
    lit = replace(scene, lighting="direct", light=LightDirection(), light_range=LightRange())
    with pytest.raises(TrainingError, match="movable light"):
        start.check(size, lit)


FULL = TrainingJob(
    out=Path("runs/a"),
    volume=VolumeSource(path=Path("v.raw"), raw="4x5x6_uint8", component="magnitude"),
    settings=("joint.batch_size=4", "l1_weight=50"),
    minutes=1.5,
    lighting="soft",
    movable_light=True,
    window=(0.25, 0.5),
    reuse=2.0,
    start=Path("models/b"),
)


@pytest.mark.parametrize(("change", "message"), [
    ({"minutes": None}, "minutes or in samples"), ({"minutes": -1.0}, "must be a number above 0"),
    ({"minutes": math.nan}, "a number above 0"), ({"minutes": math.inf}, "a number above 0"),
    ({"samples": 5}, "either"),
    ({"settings": ("nonsense=1",)}, "no 'nonsense'"),
    ({"lighting": "none"}, "no light to move"),
    ({"start": Path("runs/a")}, "write over the model"),
    ({"store": Path("s.zarr")}, "lighting and movable light and window and reuse"),
])  # fmt: skip
def test_jobs_that_make_no_sense_are_refused(change, message):
    with pytest.raises(TrainingError, match=message):
        replace(FULL, **change)


def test_samples_of_another_volume_are_refused_before_anything_is_measured(store, tmp_path):
    job = TrainingJob(tmp_path / "run", store=store.path, preset="draft", samples=24, device="cpu")
    other = tmp_path / "other_4x4x4_uint8.raw"
    other.write_bytes(bytes(range(64)))
    with pytest.raises(TrainingError, match="the data set shows 'blobs'"):
        run_job(replace(job, volume=VolumeSource(path=other)))


def test_a_model_with_a_movable_light_is_trained_and_follows_it(volume, tmp_path):
    scene = Scene.of(volume, 64, "direct", renderer="raycast", movable_light=True)
    store = SampleStore.create(tmp_path / "lit.zarr", scene, 2, {"train": 32, "holdout": 4})
    render_store(store, volume, workers=1)
    assert store.read("train", range(32)).inputs["light"].shape == (32, 2)
    job = TrainingJob(
        tmp_path / "run",
        store=store.path,
        preset="draft",
        samples=16,
        device="cpu",
        precision="float32",
    )
    run_job(job)
    assert load_card(job.out).training["precision"] == "float32"
    generator = Generator.load(job.out, "cpu")
    inputs = draw_sample(scene, 2, "holdout", 0)
    one, other = (
        generator.render(replace(inputs, light=LightDirection(*light)))
        for light in ((-60, 30), (60, -30))
    )
    assert np.abs(one[..., :3] - other[..., :3]).max() > 1e-6
    # How opaque something is does not depend on the light.
    np.testing.assert_array_equal(one[..., 3], other[..., 3])
