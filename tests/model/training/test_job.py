from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from model.errors import TrainingError
from model.generator.generator import Generator
from model.networks.card import load_card
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.samples.sampling import draw_sample
from model.scene.scene import LightDirection, Scene
from model.training.options import TrainingJob
from model.training.trainer import run_job
from model.volume_files.source import VolumeSource

FULL = TrainingJob(
    out=Path("runs/a"),
    volume=VolumeSource(path=Path("v.raw"), raw="4x5x6_uint8", component="magnitude"),
    color_attention=True,
    settings=("joint.batch_size=4", "l1_weight=50"),
    minutes=1.5,
    lighting="soft",
    movable_light=True,
    window=(0.25, 0.5),
    reuse=2.0,
    start=Path("models/b"),
)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"minutes": None}, "minutes or in samples"),
        ({"minutes": -1.0}, "not positive"),
        ({"settings": ("nonsense=1",)}, "no 'nonsense'"),
        ({"lighting": "none"}, "no light that could be moved"),
        ({"start": Path("runs/a")}, "write over the model"),
        ({"faithful": True}, "a variant"),
        ({"store": Path("s.zarr")}, "lighting and movable light and window and reuse"),
    ],
)
def test_jobs_that_make_no_sense_are_refused(change, message):
    with pytest.raises(TrainingError, match=message):
        replace(FULL, **change)


def test_the_papers_recipe_has_nothing_added_to_it():
    size = TrainingJob(Path("x"), preset="draft", faithful=True, samples=1).size
    added = size.modulation, size.opacity_modulation, size.deep_codec, size.color_attention
    assert not any(added)


def test_what_does_not_fit_is_refused_before_anything_is_measured(store, tmp_path):
    job = TrainingJob(tmp_path / "run", store=store.path, preset="draft", samples=24, device="cpu")
    with pytest.raises(TrainingError, match="64 pixels but the network draws 128") as caught:
        run_job(replace(job, preset="compact"))
    assert caught.value.suggested == {"preset": "draft"}
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
