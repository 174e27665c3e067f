import json

import numpy as np
import pytest

from model import metrics
from model.evaluation.holdout import evaluate, nearest_images, pictures
from model.samples.sampling import draw_sample


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
    assert (result.count, result.neighbors, seen) == (5, 160, [1, 2, 3, 4, 5])
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


def test_pictures_are_those_of_the_chosen_samples(lively_generator, store):
    truth, images = pictures(lively_generator, store, np.array([7, 2]))
    samples = store.read("holdout", range(8))
    np.testing.assert_allclose(truth[1], samples.rgba[2, ..., :3] / 255)
    errors = evaluate(lively_generator, store, 8).generator["rmse"]
    assert metrics.rmse(images[0], truth[0]) == pytest.approx(errors[7], abs=1e-6)
    assert metrics.rmse(images[1], truth[1]) == pytest.approx(errors[2], abs=1e-6)
