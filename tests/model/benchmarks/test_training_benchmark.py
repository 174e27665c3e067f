import shutil
from dataclasses import replace

import pytest
import torch

from model.benchmarks.training import compare_batches, compare_training
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.execution import Execution
from model.training.options import TrainingOptions

CPU = torch.device("cpu")


@pytest.mark.slow
def test_each_stage_is_timed_each_way(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    chosen = Execution("float32", False)
    monkeypatch.setattr("model.benchmarks.training.choose_execution", lambda *a: chosen)
    size = NetworkSize(0.125, 16, 32)
    options = TrainingOptions(one_stage=False)
    rows = list(compare_training(size, options, scene, CPU, steps=1))
    ways = [
        Execution("float32", False, False),
        Execution("float32", False),
        Execution("float32", True),
        Execution("bfloat16", False),
        Execution("bfloat16", True),
    ]
    assert [(r.stage, r.execution) for r in rows] == [
        (stage, way) for stage in ("opacity", "translation") for way in ways
    ]
    for row in rows:
        assert row.chosen == (row.execution == Execution("float32", False))
        plainest = next(r for r in rows if r.stage == row.stage)
        assert row.speedup == pytest.approx(plainest.seconds / row.seconds)


@pytest.mark.slow
def test_batches_are_timed_alone_and_with_rendering(
    volume: Volume, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = Execution("float32", False)
    monkeypatch.setattr("model.benchmarks.training.choose_execution", lambda *a: chosen)
    small = replace(scene, image_size=32)
    size = NetworkSize(0.125, 16, 32)
    rows = list(compare_batches(size, TrainingOptions(), small, volume, CPU, 1, (2, 4)))
    assert [(r.stage, r.batch_size, r.rendered) for r in rows] == [
        (stage, count, rendered)
        for stage in ("small", "joint")
        for count in (2, 4)
        for rendered in (False, True)
    ]
    for row in rows:
        first = next(r for r in rows if r.stage == row.stage)
        ratio = first.seconds / first.batch_size / (row.seconds / row.batch_size)
        assert row.speedup == pytest.approx(ratio)
