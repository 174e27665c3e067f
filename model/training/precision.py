"""The precision of training steps: bfloat16 where this machine computes it faster, or float32."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import torch

from model.measurements import keep, kept
from model.networks.encoding import EncodedInputs
from model.networks.names import Precision, PrecisionChoice
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene
from model.scene.transfer_function import TF_SAMPLES
from model.training.batch import EncodedBatch
from model.training.options import PRESETS, TrainingOptions
from model.training.stages import Schedule

NAME = "training precision"

TURNS = 4
"""Steps of each precision that are timed, after a first one that prepares what stays."""

EMULATED = 2.0
"""Ratio of the times from which on it needs no second look: emulated, bfloat16 takes ten times as
long, and a busy machine makes a step half as long again."""

IMAGES = 4


def choose_precision(device: torch.device, asked: PrecisionChoice = "auto") -> Precision:
    """Return the precision that is asked for; for "auto" the faster one, measured once."""
    if asked != "auto":
        return asked
    if device.type == "cuda":
        return "bfloat16" if torch.cuda.is_bf16_supported() else "float32"
    found: Precision | None = kept(NAME, {})
    if found not in ("float32", "bfloat16"):
        found = "bfloat16" if bfloat16_is_faster() else "float32"
        keep(NAME, {}, found)
    return found


def bfloat16_is_faster() -> bool:
    """Time steps of the smallest network on the CPU, a second or two."""
    running = step_seconds("bfloat16"), step_seconds("float32")
    for steps in running:
        next(steps)
    # In turn, so that other load affects both alike; it makes steps longer, never shorter.
    bfloat16, float32 = math.inf, math.inf
    for _ in range(TURNS):
        bfloat16, float32 = min(bfloat16, next(running[0])), min(float32, next(running[1]))
        if bfloat16 > EMULATED * float32:
            break
    return bfloat16 < float32


def step_seconds(precision: Precision) -> Iterator[float]:
    """Train the smallest network on random numbers, endlessly, and yield each step's duration."""
    size, device = PRESETS["draft"], torch.device("cpu")
    scene = Scene("random", "", (0.0, 1.0), (0.0, 1.0), size.image_size)
    stage = Schedule(size, TrainingOptions(), scene, device, precision).stages["joint"]

    def draw(*shape: int) -> torch.Tensor:
        return 2 * torch.rand(IMAGES, *shape) - 1

    batch = EncodedBatch(
        EncodedInputs(draw(condition_numbers(scene)), draw(TF_SAMPLES), draw(3, TF_SAMPLES)),
        opacity_image=draw(1, size.opacity_size, size.opacity_size),
        image=draw(3, size.image_size, size.image_size),
    )
    while True:
        start = time.perf_counter()
        stage.step(batch, 0.5)
        yield time.perf_counter() - start
