import shutil

import pytest
import torch

from model.networks.blocks import NetworkSize
from model.scene import Scene
from model.training.options import TrainingOptions
from model.training_benchmark import compare_training

CPU = torch.device("cpu")


def test_each_stage_is_timed_each_way(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    size = NetworkSize(0.125, 16, 32)
    options = TrainingOptions(one_stage=False)
    rows = list(compare_training(size, options, scene, CPU, steps=1))
    assert [(r.stage, r.precision, r.channels_last, r.compiled) for r in rows] == [
        (stage, precision, last, False)
        for stage in ("opacity", "translation")
        for precision in ("float32", "bfloat16")
        for last in (False, True)
    ]
    for row in rows:
        slowest = next(r for r in rows if r.stage == row.stage)
        assert row.speedup == pytest.approx(slowest.seconds / row.seconds)
