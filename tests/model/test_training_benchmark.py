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
    assert [(r.stage, r.precision, r.channels_last, r.fused, r.compiled) for r in rows] == [
        (stage, *way, False)
        for stage in ("opacity", "translation")
        for way in (
            ("float32", False, False),
            ("float32", False, True),
            ("float32", True, True),
            ("bfloat16", False, True),
            ("bfloat16", True, True),
        )
    ]
    for row in rows:
        plainest = next(r for r in rows if r.stage == row.stage)
        assert row.speedup == pytest.approx(plainest.seconds / row.seconds)
