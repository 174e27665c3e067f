"""Training jobs as plain data, and runs that follow from them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from safetensors.torch import load_file

from model.errors import DatasetError, TrainingError
from model.networks.card import load_card
from model.samples.sample_store import SampleStore
from model.scene.light import LightDirection, LightRange
from model.scene.volume import Volume
from model.training.execution import Execution
from model.training.job import TrainingJob
from model.training.plan import TrainingReport
from model.training.running import run_job
from model.training.stopping import STOP_FILE, ask_to_stop
from model.training.warm_start import WarmStart
from model.volume_files.source import VolumeSource

FULL = TrainingJob(
    out=Path("runs/a"),
    volume=VolumeSource(Path("v.raw"), "4x5x6_uint8", "magnitude"),
    preset="draft",
    color_attention=True,
    width=0.5,
    settings=("joint.batch_size=4", "l1_weight=50"),
    minutes=1.5,
    lighting="soft",
    movable_light=True,
    renderer="vtk",
    window=(0.25, 0.5),
    reuse=2.0,
    start=Path("models/b"),
    seed=7,
    workers=2,
    device="cpu",
    precision="float32",
    resume=True,
)


@pytest.mark.parametrize("job", [FULL, TrainingJob(Path("x"), samples=3, store=Path("s.zarr"))])
def test_a_job_comes_back_from_its_file(job: TrainingJob, tmp_path: Path) -> None:
    job.save(tmp_path / "job.json")
    assert TrainingJob.load(tmp_path / "job.json") == job


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "cannot be read"),
        ("[]", "not a training job"),
        ('{"tfscope_job": 2}', "not a training job"),
        ('{"tfscope_job": 3}', "malformed"),
        (json.dumps({**FULL.to_json(), "unknown": 1}), "malformed"),
        (json.dumps({**FULL.to_json(), "window": 3}), "malformed"),
        (json.dumps({**FULL.to_json(), "settings": "abc"}), "malformed"),
        (json.dumps({**FULL.to_json(), "preset": "huge"}), "choose draft, compact, large, paper"),
    ],
)
def test_a_file_that_is_no_job_is_refused(content: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "job.json"
    path.write_text(content)
    with pytest.raises(TrainingError, match=message) as caught:
        TrainingJob.load(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"minutes": None}, "minutes or in samples"),
        ({"seed": "abc"}, "whole number from 0"),
        ({"workers": 0}, "whole number from 1"),
        ({"reuse": 0}, "number from 1"),
        ({"width": 0}, "above 0, up to 4"),
        ({"resume": "no"}, "true or false"),
        ({"lighting": "bogus"}, "choose none, direct, soft, shadows"),
        ({"device": "tpu"}, "choose auto, cpu, cuda"),
        ({"minutes": -1.0}, "not positive"),
        ({"settings": ("nonsense=1",)}, "no 'nonsense'"),
        ({"lighting": "none"}, "no light that could be moved"),
        ({"start": Path("runs/a")}, "write over the model"),
        ({"faithful": True}, "a variant"),
        ({"store": Path("s.zarr")}, "lighting and movable light and window and reuse"),
    ],
)
def test_jobs_that_make_no_sense_are_refused(change: dict, message: str) -> None:
    with pytest.raises(TrainingError, match=message):
        replace(FULL, **change)


def test_the_papers_recipe_has_nothing_added_to_it() -> None:
    size = TrainingJob(Path("x"), preset="draft", faithful=True, samples=1).size
    added = size.modulation, size.opacity_modulation, size.deep_codec, size.color_attention
    assert not any(added)


@pytest.fixture
def job(store: SampleStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> TrainingJob:
    monkeypatch.setattr(
        "model.training.running.choose_execution", lambda *arguments: Execution("float32")
    )
    return TrainingJob(
        tmp_path / "run",
        store=store.path,
        preset="draft",
        samples=24,
        settings=("joint.batch_size=4", "unrendered_tfs=0"),
        device="cpu",
    )


@pytest.mark.slow
def test_the_same_job_from_its_file_gives_the_same_model(job: TrainingJob, tmp_path: Path) -> None:
    told: list[Execution] = []
    run_job(job, on_execution=told.append)
    assert told == [Execution("float32")]
    job.save(tmp_path / "job.json")
    run_job(replace(TrainingJob.load(tmp_path / "job.json"), out=tmp_path / "again"))
    one, other = (
        load_file(next(folder.glob("generator-*.safetensors")))
        for folder in (job.out, tmp_path / "again")
    )
    assert one.keys() == other.keys()
    assert all(bool((one[name] == other[name]).all()) for name in one)
    assert load_card(job.out).training["execution"]["precision"] == "float32"


def test_a_file_in_its_folder_stops_a_run(job: TrainingJob) -> None:
    reports: list[TrainingReport] = []

    def stop(report: TrainingReport) -> None:
        reports.append(report)
        if len(reports) == 2:
            ask_to_stop(job.out)

    with pytest.raises(KeyboardInterrupt):
        run_job(job, stop)
    assert len(reports) <= 3
    assert not (job.out / STOP_FILE).exists()
    seen = reports[-1].samples
    run_job(replace(job, resume=True), reports.append)
    assert reports[-1].samples == 24
    assert reports[len(reports) - (24 - seen) // 4].samples == seen + 4


def test_a_finished_run_cannot_be_stopped(job: TrainingJob) -> None:
    run_job(job)
    with pytest.raises(TrainingError, match="nobody is training there"):
        ask_to_stop(job.out)
    assert not (job.out / STOP_FILE).exists()


def test_a_wish_to_stop_is_heard_while_all_is_prepared(
    job: TrainingJob, monkeypatch: pytest.MonkeyPatch
) -> None:
    def prepare(*arguments: object) -> Execution:
        ask_to_stop(job.out)
        return Execution()

    monkeypatch.setattr("model.training.running.choose_execution", prepare)
    reports: list[TrainingReport] = []
    with pytest.raises(KeyboardInterrupt):
        run_job(job, reports.append)
    assert len(reports) <= 1


def test_a_movable_light_does_not_start_from_a_fixed_one(
    job: TrainingJob, store: SampleStore
) -> None:
    run_job(job)
    start = WarmStart.read(job.out)
    lit = replace(store.scene, lighting="direct", light=LightDirection())
    with pytest.raises(TrainingError, match="movable light"):
        start.check(job.size, replace(lit, light_range=LightRange()))


def test_samples_of_another_size_are_refused_before_anything_is_measured(job: TrainingJob) -> None:
    with pytest.raises(TrainingError, match="64 pixels but the network draws 128") as caught:
        run_job(replace(job, preset="compact"))
    assert caught.value.suggested == {"preset": "draft"}


def test_an_old_wish_to_stop_is_forgotten(job: TrainingJob) -> None:
    job.out.mkdir()
    (job.out / STOP_FILE).touch()
    run_job(job)
    assert not (job.out / STOP_FILE).exists()


def test_a_run_that_is_not_there_cannot_be_stopped(tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="nobody is training there"):
        ask_to_stop(tmp_path / "nowhere")


def test_another_volume_than_the_data_sets_is_refused(job: TrainingJob, tmp_path: Path) -> None:
    path = tmp_path / "other_4x4x4_uint8.raw"
    path.write_bytes(bytes(range(64)))
    with pytest.raises(TrainingError, match="the data set shows 'blobs'"):
        run_job(replace(job, volume=VolumeSource(path)))


def write_mhd(path: Path, volume: Volume) -> None:
    """A MetaImage of bytes with that volume's spacing."""
    path.with_suffix(".raw").write_bytes(volume.scalars.tobytes())
    sizes, spacing = (" ".join(map(str, x)) for x in (volume.dimensions, volume.spacing))
    path.write_text(
        f"NDims = 3\nDimSize = {sizes}\nElementSpacing = {spacing}\n"
        f"ElementType = MET_UCHAR\nElementDataFile = {path.stem}.raw\n"
    )


def test_a_model_with_a_movable_light_is_trained_and_follows_it(
    volume: Volume, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from model.generator.generator import Generator
    from model.samples.sample_rendering import render_store
    from model.samples.sampling import draw_sample
    from model.scene.light import LightDirection
    from model.scene.scene import Scene

    monkeypatch.setattr("model.training.monitor.PROBE_SAMPLES", 4)
    monkeypatch.setattr("model.training.running.choose_execution", lambda *a: Execution())
    scene = Scene.of(volume, 64, "direct", renderer="raycast", movable_light=True)
    store = SampleStore.create(tmp_path / "lit.zarr", scene, 2, {"train": 32, "holdout": 4})
    render_store(store, volume, workers=1)
    stored = SampleStore(store.path).read("train", range(32))
    assert stored.inputs["light"].shape == (32, 2)
    voxels = tmp_path / "blobs.mhd"
    write_mhd(voxels, volume)
    job = TrainingJob(
        tmp_path / "run",
        volume=VolumeSource(voxels),
        store=store.path,
        preset="draft",
        samples=16,
        device="cpu",
    )
    run_job(job)
    generator = Generator.load(job.out, "cpu")
    inputs = draw_sample(scene, 2, "holdout", 0)
    one, other = (
        generator.render(replace(inputs, light=LightDirection(*light)))
        for light in ((-60, 30), (60, -30))
    )
    assert abs(one[..., :3] - other[..., :3]).max() > 1e-6
    # How opaque something is does not depend on the light.
    assert abs(one[..., 3] - other[..., 3]).max() == 0


def test_a_store_of_another_scene_is_no_store_to_go_on_with(volume: Volume, tmp_path: Path) -> None:
    from model.scene.scene import Scene

    fixed = Scene.of(volume, 16, "direct")
    SampleStore.create(tmp_path / "s.zarr", fixed, 0, {"train": 2})
    with pytest.raises(DatasetError, match="another volume, size, lighting or seed"):
        SampleStore.create(
            tmp_path / "s.zarr", Scene.of(volume, 16, "direct", movable_light=True), 0, {"train": 2}
        )
