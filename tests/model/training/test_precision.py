"""The precision of training steps, measured once on a machine."""

import pytest
import torch

from model.training import plan as precision
from model.training.plan import choose_precision

CPU = torch.device("cpu")


@pytest.mark.parametrize(
    ("seconds", "faster"),
    [
        # The first step is not counted, nor what other work does to a single one.
        ({"bfloat16": [9.0, 0.9, 0.5, 0.6, 0.6], "float32": [1.0, 0.8, 0.8, 0.8, 0.8]}, "bfloat16"),
        ({"bfloat16": [1.0, 0.8, 0.8, 0.8, 0.8], "float32": [1.0, 1.5, 0.7, 0.8, 0.8]}, "float32"),
        # Emulated: one of its steps is enough.
        ({"bfloat16": [1.0, 7.0], "float32": [1.0, 0.8]}, "float32"),
    ],
)
def test_the_faster_one_is_chosen_and_measured_once(seconds, faster, monkeypatch, tmp_path):
    monkeypatch.setattr("model.measurements.cache_folder", lambda: tmp_path)
    timed = []

    def steps(kind):
        timed.append(kind)
        yield from seconds[kind]

    monkeypatch.setattr(precision, "step_seconds", steps)
    assert [choose_precision(CPU), choose_precision(CPU)] == [faster, faster]
    assert timed == ["bfloat16", "float32"]
    assert choose_precision(CPU, "bfloat16") == "bfloat16"
