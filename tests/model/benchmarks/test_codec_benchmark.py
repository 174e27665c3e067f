from dataclasses import replace

import numpy as np
import pytest
from told_codec import Told

from model.benchmarks.codec import CHECKED_SEED, CHECKED_TFS, measure_codec, train_codec
from model.errors import TrainingError
from model.networks.size import NetworkSize
from model.samples.sampling import draw_opacity_tfs
from model.scene.scene import Scene
from model.training.options import TrainingOptions

SIZE = NetworkSize(0.25, 16, 32, deep_codec=True)


def test_a_codec_without_faults_has_none(scene: Scene) -> None:
    row = measure_codec(Told(lambda tf: tf), scene)  # type: ignore[arg-type]
    assert all(error == 0 for error in row.layer_rmse.values())
    assert row.edit_cosine == pytest.approx((1, 1, 1), abs=1e-6)


def test_errors_are_those_of_layers(scene: Scene) -> None:
    # All TFs decoded as transparent: the error is what the layers' true opacity is.
    row = measure_codec(Told(lambda tf: 0 * tf - 1), scene)  # type: ignore[arg-type]
    tfs = draw_opacity_tfs(scene, CHECKED_SEED, 0, CHECKED_TFS).astype(np.float64)
    for voxels, error in row.layer_rmse.items():
        shown = 1 - np.prod(np.stack([1 - tfs] * voxels), axis=0)
        assert error == pytest.approx(np.sqrt(np.mean(shown**2)), rel=1e-5)
    assert row.edit_cosine == (0, 0, 0)


@pytest.mark.slow
def test_edits_that_show_elsewhere_are_not_followed(scene: Scene) -> None:
    half = measure_codec(Told(lambda tf: tf / 2), scene)  # type: ignore[arg-type]
    back = measure_codec(Told(lambda tf: -tf), scene)  # type: ignore[arg-type]
    away = measure_codec(Told(lambda tf: tf.roll(60, 1)), scene)  # type: ignore[arg-type]
    assert half.edit_cosine == pytest.approx((1, 1, 1), abs=1e-6)  # the height does not matter
    assert back.edit_cosine == pytest.approx((-1, -1, -1), abs=1e-6)
    assert max(away.edit_cosine) < 0.1


@pytest.mark.slow
def test_a_codec_alone_learns(scene: Scene) -> None:
    options = replace(TrainingOptions(), unrendered_tfs=16)
    rows = list(train_codec(SIZE, options, scene, 200))
    assert [row.steps for row in rows] == [50, 100, 150, 200]
    # A code that keeps nothing could at best be decoded as the mean TF.
    tfs = draw_opacity_tfs(scene, CHECKED_SEED, 0, CHECKED_TFS)
    assert rows[-1].layer_rmse[1] < 0.9 * float(np.sqrt(tfs.var(axis=0).mean()))
    assert rows[-1].edit_cosine[2] > rows[0].edit_cosine[2]
    again = list(train_codec(SIZE, options, scene, 200))
    assert again == rows


def test_it_needs_tfs_to_learn_from(scene: Scene) -> None:
    with pytest.raises(TrainingError, match="unrendered_tfs"):
        next(train_codec(SIZE, replace(TrainingOptions(), unrendered_tfs=0), scene, 4))
