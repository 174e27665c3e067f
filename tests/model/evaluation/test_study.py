import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from model import metrics
from model.errors import TrainingError
from model.evaluation.holdout import evaluate, nearest_images
from model.evaluation.study import STUDIES, Study, StudyPlan, Variant, markdown, run_study
from model.generator.generator import Generator
from model.networks.generator_network import LatentCodec
from model.networks.size import NetworkSize
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.training.options import Budget, StageOptions, TrainingOptions
from model.training.plan import TrainingPlan
from model.training.sources import StoredSource

SMALL = NetworkSize(width=1 / 16, opacity_size=16, image_size=16)
STUDY = Study(
    "Two dimensions",
    "made up",
    (Variant("a", "two", (), 2, (0.1, 0.2)), Variant("b", "eight", ("l1_weight=50",), 8)),
    neighbor=(0.3, 0.4),
)


@pytest.fixture(scope="module")
def samples(volume, tmp_path_factory):
    scene = Scene.of(volume, 16)
    path = tmp_path_factory.mktemp("stores") / "samples.zarr"
    store = SampleStore.create(path, scene, 0, {"train": 32, "holdout": 6})
    render_store(store, volume, 1)
    return store


def plan_in(folder, volume, samples):
    base = TrainingPlan(
        source=StoredSource(samples),
        preset="tiny",
        size=SMALL,
        options=TrainingOptions(joint=StageOptions(8, 1e-3, 1)),
        budget=Budget(samples=24),
        folder=folder,
        device=torch.device("cpu"),
    )
    return StudyPlan(samples, volume, base, count=6, sensitivities=1)


@pytest.fixture
def plan(tmp_path, volume, samples):
    return plan_in(tmp_path / "study", volume, samples)


@pytest.fixture(scope="module")
def studied(volume, samples, tmp_path_factory):
    """A study that is finished, and its result. Only to be looked at."""
    plan = plan_in(tmp_path_factory.mktemp("study"), volume, samples)
    return plan, run_study(STUDY, plan)


def test_each_variant_is_trained_as_it_says_and_measured_like_evaluate(studied):
    plan, result = studied
    for variant, dimension, weight in zip(STUDY.variants, (2, 8), (150, 50), strict=True):
        generator = Generator.load(plan.base.folder / variant.name)
        assert generator.card.size.latent_dim == dimension
        assert generator.card.training["options"]["l1_weight"] == weight
        row = result["variants"][variant.name]
        expected = evaluate(generator, plan.store, 6)
        assert row["rmse"] == pytest.approx(expected.generator["rmse"].mean())
        assert row["emd"] == pytest.approx(expected.generator["emd"].mean())
        assert row["samples_seen"] == 24
        assert -1 <= row["image_cosine"] <= 1
    assert result["nearest_neighbor"]["count"] == 32


def test_what_is_finished_is_not_trained_again_and_what_was_stopped_goes_on(plan):
    begun = []
    steps = []

    def stop(report):
        steps.append(len(begun))
        if len(begun) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(STUDY, plan, lambda v: begun.append(v.name), stop)
    assert steps == [1, 1, 1, 2]
    steps.clear()
    again = []
    note = lambda v: again.append(v.name), lambda r: steps.append(r.samples)
    first = run_study(STUDY, plan, *note)
    assert steps == [16, 24]
    assert first == json.loads(json.dumps(run_study(STUDY, plan)))


def test_a_collapse_is_a_result_and_the_study_goes_on(plan, monkeypatch):
    monkeypatch.setattr("model.training.monitor.WARM_UP", 0)
    monkeypatch.setattr("model.training.monitor.LEAST_DIVERSITY", 0)
    begun = []
    encode = LatentCodec.encode

    def collapsing(self, opacity_tf):
        return encode(self, opacity_tf) * (0 if begun == ["a"] else 1)

    with monkeypatch.context() as patch:
        patch.setattr(LatentCodec, "encode", collapsing)
        result = run_study(STUDY, plan, lambda v: begun.append(v.name))
    assert "codes of all opacity TFs" in result["variants"]["a"]["collapsed"]
    assert result["variants"]["b"]["samples_seen"] == 24
    table = markdown(STUDY, result)
    assert "| two (collapsed) |" in table
    assert "codes of all opacity TFs" in table
    # It is not tried again.
    again = []
    assert run_study(STUDY, plan, on_report=lambda r: again.append(r.samples)) == json.loads(
        json.dumps(result)
    )
    assert not again


def changed(plan, **what):
    return replace(plan, base=replace(plan.base, **what))


def test_another_recipe_needs_another_folder(studied):
    plan, _ = studied
    other = changed(plan, options=plan.base.options.with_settings(["beta2=0.9"]))
    with pytest.raises(TrainingError, match=r"options\.beta2 .*, not 0\.9"):
        run_study(STUDY, other)
    with pytest.raises(TrainingError, match="another budget"):
        run_study(STUDY, changed(plan, budget=Budget(samples=32)))


def test_the_table_has_the_papers_numbers_beside_ours(studied):
    plan, result = studied
    text = markdown(STUDY, result)
    lines = [line for line in text.splitlines() if line.startswith("|")]
    nearest, two, eight = (line.strip("| ").split(" | ") for line in lines[-3:])
    assert nearest[0] == "nearest of 32"
    assert nearest[-2:] == ["0.300", "0.400"]
    assert two[0] == "two"
    assert two[-2:] == ["0.100", "0.200"]
    assert eight[0] == "eight"
    # Beneath is the whole recipe, as settings that `train --set` takes, and what each changes.
    recipe, changes = text.splitlines()[-3], text.splitlines()[-1]
    settings = recipe.removeprefix("Recipe of all: ").removesuffix(".").split(", ")
    assert TrainingOptions().with_settings(settings) == plan.base.options
    assert "eight: l1_weight=50, codes of 8 numbers" in changes


@pytest.mark.parametrize("study", STUDIES.values(), ids=list(STUDIES))
def test_the_papers_studies_have_valid_recipes(study):
    for variant in study.variants:
        TrainingOptions().with_settings(variant.settings)
    assert len({v.name for v in study.variants}) == len(study.variants)


def test_nearest_images_have_the_smallest_rmse(store):
    queries = store.read("holdout", range(32)).rgba
    training = store.read("train", range(160)).rgba
    colors = training[..., :3].astype(int)
    for query, found in zip(queries, nearest_images(queries, store), strict=True):
        errors = [np.mean((query[..., :3] - image) ** 2) for image in colors]
        np.testing.assert_array_equal(found, training[int(np.argmin(errors))])


def test_errors_are_those_of_the_rendered_images(lively_generator, store):
    seen = []
    result = evaluate(lively_generator, store, 5, seen.append)
    assert (len(result.generator["rmse"]), result.neighbors, seen) == (5, 160, [1, 2, 3, 4, 5])
    sample = draw_sample(store.scene, store.seed, "holdout", 3)
    image = lively_generator.render(sample)[..., :3]
    truth = store.read("holdout", range(3, 4)).rgba[0, ..., :3] / 255
    assert result.generator["rmse"][3] == pytest.approx(metrics.rmse(image, truth), abs=1e-5)
    assert result.generator["emd"][3] == pytest.approx(metrics.color_emd(image, truth), abs=1e-3)
    assert result.generator["ssim"][3] == pytest.approx(metrics.ssim(image, truth), abs=1e-4)
    neighbor = nearest_images(store.read("holdout", range(3, 4)).rgba, store)[0, ..., :3] / 255
    assert result.nearest_neighbor["rmse"][3] == pytest.approx(metrics.rmse(neighbor, truth))


def test_the_report_has_the_documented_keys(lively_generator, store):
    report = json.loads(json.dumps(evaluate(lively_generator, store, 4).to_json(), allow_nan=False))
    assert report["count"] == 4
    assert report["nearest_neighbor"]["count"] == 160
    for part, keys in (
        (report, ("rmse", "emd", "ssim", "flip")),
        (report["nearest_neighbor"], ("rmse", "emd")),
    ):
        for key in keys:
            assert set(part[key]) == {"mean", "median", "p95", "interval"}
            low, high = part[key]["interval"]
            assert low <= part[key]["mean"] <= high
