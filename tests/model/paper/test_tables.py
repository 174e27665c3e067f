import numpy as np
import pytest

from model import metrics
from model.paper.pictures import compared_samples
from model.paper.tables import PAPER_TABLE_1, holdout_errors, nearest_errors, table_1, table_2
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.samples.sampling import draw_sample


def test_hold_out_errors_are_means_over_samples(subject):
    pairs = []
    for index in range(4):
        inputs = draw_sample(subject.generator.scene, subject.seed, "holdout", index)
        # True images are stored in bytes.
        truth = np.rint(np.clip(subject.truth(inputs), 0, 1) * 255) / 255
        pairs.append((subject.drawn(inputs), truth))
    found = holdout_errors(subject, 4)
    assert found["rmse"] == pytest.approx(np.mean([metrics.rmse(*p) for p in pairs]), rel=1e-3)
    assert found["emd"] == pytest.approx(np.mean([metrics.color_emd(*p) for p in pairs]), rel=1e-2)


def test_table_1_has_our_rows_before_the_papers(subject, tmp_path):
    errors = holdout_errors(subject, 4)
    table = table_1([subject], [errors], 4, 2)
    assert len(table.rows) == 1 + len(PAPER_TABLE_1)
    assert {len(row) for row in table.rows} == {len(table.heading)}
    ours = dict(zip(table.heading, table.rows[0], strict=True))
    assert ours["image RMSE"] == f"{errors['rmse']:.3f}"[1:]
    assert ours["resolution"] == " x ".join(map(str, subject.volume.dimensions))
    # The paper's jet, as it is printed there.
    assert table.rows[7][:1] + table.rows[7][5:8] == ("paper: Jet", "4 h", ".086", ".022")
    path = tmp_path / "s.zarr"
    store = SampleStore.create(path, subject.generator.scene, 0, {"train": 4, "holdout": 4})
    store.add_rendering(36.0, 100)
    timed = table_1([subject], [errors], 4, 2, store)
    # 200,000 images at .36 s each.
    assert timed.rows[0][5] == "20.0 h"


@pytest.mark.slow
def test_models_are_compared_on_the_samples_of_a_data_set(subject, tmp_path):
    scene, seed = subject.generator.scene, subject.seed + 1
    store = SampleStore.create(tmp_path / "s.zarr", scene, seed, {"train": 4, "holdout": 4})
    render_store(store, subject.volume, 1)
    own = holdout_errors(subject, 4)
    found = holdout_errors(subject, 4, store=store)
    images = store.read("holdout", range(4)).rgba[..., :3] / 255.0
    inputs = [draw_sample(scene, seed, "holdout", index) for index in range(4)]
    drawn = [metrics.rmse(subject.drawn(i), t) for i, t in zip(inputs, images, strict=True)]
    assert found["rmse"] == pytest.approx(np.mean(drawn), rel=1e-3)
    assert found["rmse"] != own["rmse"]

    known = store.read("train", range(4)).rgba[..., :3] / 255.0
    least = [min(metrics.rmse(other, image) for other in known) for image in images]
    nearest = nearest_errors(store, 4)
    assert nearest["rmse"] == pytest.approx(np.mean(least), rel=1e-6)

    table = table_1([subject, subject], [found, own], 4, 2, store, nearest)
    assert table.rows[0][0] == f"{subject.volume.name}: {subject.folder.name}"
    assert table.rows[2][0].startswith("nearest of 4 training images")
    assert table.rows[2][6] == f"{nearest['rmse']:.3f}"[1:]


@pytest.mark.slow
def test_table_2_has_the_size_of_the_networks(subject):
    table = table_2(subject, 1)
    weights = sum(p.numel() for p in subject.generator.network.parameters())
    assert table.rows[0][1].startswith(f"{4 * weights / 1e6:.0f} MB")
    assert {len(row) for row in table.rows} == {len(table.heading)}


def test_artifacts_are_the_worst_of_their_kind(subject, monkeypatch):
    count = 12
    errors = {
        "rmse": np.linspace(0.1, 0.2, count),
        "emd": np.where(np.arange(count) == 3, 0.9, 0.1),
        "opacity_rmse": np.where(np.arange(count) == 3, 0.9, np.linspace(0.1, 0.5, count)),
    }
    monkeypatch.setattr("model.paper.pictures.generator_errors", lambda g, s: errors)
    monkeypatch.setattr("model.metrics.LEAST_BRIGHTNESS", 0.0)
    found = compared_samples(subject, count)
    by = {sample.why: sample.index for sample in found}
    # The same sample is the worst in both: the second artifact is the next.
    assert by["colours"] == 3
    assert by["shape"] == count - 1
    typical = [sample.index for sample in found if sample.why == "typical"]
    assert typical == sorted(typical) and set(typical) <= {2, 4, 5, 7}
    for sample in found:
        inputs = draw_sample(subject.generator.scene, subject.seed, "holdout", sample.index)
        assert sample.inputs == inputs
        np.testing.assert_allclose(sample.truth, subject.truth(inputs), atol=0.003)
