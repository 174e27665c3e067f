"""The choice of how steps are computed, on made-up processors and on this one."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch

from model.errors import DeviceError
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.training import execution_choice
from model.training.execution import Execution
from model.training.execution_choice import choose_execution
from model.training.options import TrainingOptions

CPU = torch.device("cpu")
SIZE = NetworkSize(0.125, 16, 32)


class MadeUp:
    """Steps that take no time, but are said to; by precision, order of channels, optimizer."""

    def __init__(self, bfloat16: float, last: float = 1.0, plain: float = 1.0) -> None:
        self.factors = bfloat16, last, plain
        self.timed: list[Execution] = []

    def __call__(self, *arguments: object) -> Iterator[float]:
        way = arguments[-1]
        assert isinstance(way, Execution)
        self.timed.append(way)
        bfloat16, last, plain = self.factors
        seconds = 0.3
        seconds *= bfloat16 if way.precision == "bfloat16" else 1
        seconds *= last if way.channels_last else 1
        seconds *= 1 if way.fused else plain
        return itertools.repeat(seconds)


@pytest.fixture(autouse=True)
def own_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    monkeypatch.setattr(execution_choice, "RUN_SECONDS", 0.01)


def chosen(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, processor: MadeUp, precision: str = "auto"
) -> Execution:
    monkeypatch.setattr(execution_choice, "step_seconds", processor)
    monkeypatch.setattr(execution_choice, "bfloat16_is_slow", lambda device: False)
    return choose_execution(SIZE, TrainingOptions(), scene, CPU, precision)


@pytest.mark.parametrize(
    ("processor", "expected"),
    [
        (MadeUp(bfloat16=0.6), Execution("bfloat16", True)),
        (MadeUp(bfloat16=0.6, last=1.2), Execution("bfloat16", False)),
        (MadeUp(bfloat16=8.0), Execution("float32", True)),
        (MadeUp(bfloat16=8.0, last=1.2), Execution("float32", False)),
        (MadeUp(bfloat16=0.6, plain=0.5), Execution("bfloat16", True, fused=False)),
        (MadeUp(bfloat16=0.99, last=0.99), Execution("bfloat16", True)),
    ],
)
def test_the_fastest_is_taken(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, processor: MadeUp, expected: Execution
) -> None:
    assert chosen(scene, monkeypatch, processor) == expected


def test_a_step_that_was_held_up_decides_nothing(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    class HeldUp(MadeUp):
        def __call__(self, *arguments: object) -> Iterator[float]:
            steps = super().__call__(*arguments)
            way = arguments[-1]
            assert isinstance(way, Execution)
            # The first step is not timed.
            held_up = [0.1, 2.0] if way.precision == "bfloat16" else []
            return itertools.chain(held_up, steps)

    assert chosen(scene, monkeypatch, HeldUp(bfloat16=0.6)).precision == "bfloat16"


def test_a_choice_is_measured_once(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = MadeUp(0.6), MadeUp(8.0)
    assert chosen(scene, monkeypatch, first) == chosen(scene, monkeypatch, second)
    assert first.timed
    assert not second.timed
    monkeypatch.setenv("ONEDNN_MAX_CPU_ISA", "AVX2")
    assert chosen(scene, monkeypatch, second).precision == "float32"


def test_a_damaged_memory_is_measured_anew(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    expected = chosen(scene, monkeypatch, MadeUp(0.6))
    (path,) = tmp_path.rglob("measurements.json")
    for damage in ("", "[1]", path.read_text().replace("channels_last", "channels")):
        path.write_text(damage)
        assert chosen(scene, monkeypatch, MadeUp(0.6)) == expected


def test_a_precision_can_be_asked_for(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    assert chosen(scene, monkeypatch, MadeUp(8.0), "bfloat16").precision == "bfloat16"
    assert chosen(scene, monkeypatch, MadeUp(0.6), "float32").precision == "float32"
    with pytest.raises(DeviceError, match="choose auto, float32, bfloat16"):
        chosen(scene, monkeypatch, MadeUp(1.0), "float16")


WITHOUT_BFLOAT16 = """
import torch
from model.training.execution_choice import bfloat16_is_slow
print(bfloat16_is_slow(torch.device("cpu")))
"""


def test_a_processor_without_bfloat16_is_noticed() -> None:
    process = subprocess.run(
        [sys.executable, "-c", WITHOUT_BFLOAT16],
        capture_output=True,
        env={**os.environ, "ONEDNN_MAX_CPU_ISA": "AVX2", "PYTHONPATH": str(Path.cwd())},
        text=True,
    )
    assert (process.returncode, process.stdout) == (0, "True\n"), process.stderr


@pytest.mark.slow
def test_real_steps_are_timed(scene: Scene) -> None:
    way = choose_execution(SIZE, TrainingOptions(), scene, CPU)
    assert way == choose_execution(SIZE, TrainingOptions(), scene, CPU)
