"""Choice of the fastest execution settings for training, by measuring on this machine.

No settings are fastest everywhere. On processors with bfloat16 instructions, bfloat16
steps take 0.6 of float32's time, on those without eight times as long; the memory order
of channels matters on some processors only.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from itertools import product
from typing import get_args

import torch
from torch import nn

from model.errors import DeviceError
from model.measurements import keep, kept
from model.networks.encoding import EncodedInputs
from model.networks.names import Precision
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene
from model.scene.transfer_function import TF_SAMPLES
from model.training.batch import EncodedBatch
from model.training.execution import Execution
from model.training.options import STAGES, TrainingOptions
from model.training.recording import FIRST_PASSES
from model.training.schedule import Schedule

RUN_SECONDS = 8.0
"""Time for all ways together, after the first step of each."""

HOPELESS = 1.3
"""A candidate that is slower than the fastest by this factor is not measured further."""

LEAST_STEPS = 3
"""Steps after which a candidate may be hopeless: a single one may have been held up."""

EMULATED = 2.0
"""Ratio of a convolution's times in bfloat16 and float32 from which on bfloat16 is emulated.

Emulation makes it eight times as long, a busy machine up to half as long again.
"""

ALIKE = 1.03
"""Candidates whose step times differ by less than this factor count as equally fast."""

TIMED_IMAGES = 16
"""Most images of a timed step on a CPU: each takes within a fifth as long as in a batch of 64.

At the paper's width a step of a whole batch takes 5 to 20 s, and some of each way are timed.
"""

LATE = 0.999
"""Fraction of a stage's budget at which its steps are timed: a discriminator has joined."""

NAME = "training"


def choose_execution(
    size: NetworkSize,
    options: TrainingOptions,
    scene: Scene,
    device: torch.device,
    precision: str = "auto",
) -> Execution:
    """Return the fastest execution settings on this machine, measured once and then cached.

    Parameters
    ----------
    precision : {"auto", "float32", "bfloat16"}
        "auto" leaves the choice to the measurement.

    Raises
    ------
    DeviceError
        When the precision is unknown.
    """
    if precision not in ("auto", *get_args(Precision)):
        names = ", ".join(("auto", *get_args(Precision)))
        raise DeviceError(f"The precision '{precision}' is unknown; choose {names}.")
    about = {
        "size": asdict(size),
        "conditions": condition_numbers(scene),
        "batches": [options.opacity.batch_size, options.joint.batch_size],
        "stages": [options.one_stage, options.adversarial_start],
        "device": device.type,
        "precision": precision,
    }
    found = kept(NAME, about)
    if found is not None:
        with suppress(TypeError):  # Another version may have cached other fields.
            execution = Execution(**found)
            if execution.precision in get_args(Precision) and precision in (
                "auto",
                execution.precision,
            ):
                return execution
    steps_of = partial(step_seconds, size, timed_options(options, device), scene, device)
    fastest = _fastest(steps_of, device, precision)
    keep(NAME, about, asdict(fastest))
    return fastest


def timed_options(options: TrainingOptions, device: torch.device) -> TrainingOptions:
    """Return a recipe with the batches that are timed instead of its own."""
    if device.type == "cuda":
        return options
    smaller = {}
    for name in STAGES:
        stage = getattr(options, name)
        smaller[name] = replace(stage, batch_size=min(stage.batch_size, TIMED_IMAGES))
    return replace(options, **smaller)


def step_seconds(
    size: NetworkSize,
    options: TrainingOptions,
    scene: Scene,
    device: torch.device,
    execution: Execution,
    stage: str | None = None,
) -> Iterator[float]:
    """Run optimization steps on random images endlessly and yield each one's duration.

    Parameters
    ----------
    stage : str, optional
        Name of the stage that is timed; by default the last.

    Yields
    ------
    float
        Seconds.
    """
    stages = Schedule(size, options, scene, device, execution).stages
    timed = stages[stage or list(stages)[-1]]
    drawn = replace(size, image_size=timed.image_size or size.image_size)
    batch = _noise(timed.stage.batch_size, drawn, condition_numbers(scene)).to(device)
    while True:
        start = time.perf_counter()
        # The step returns numbers on the CPU, so a GPU has finished by then.
        timed.step(batch, LATE)
        yield time.perf_counter() - start


def _noise(count: int, size: NetworkSize, conditions: int) -> EncodedBatch:
    """Return a batch of random numbers, which take as long to process as images."""
    random = torch.Generator().manual_seed(0)

    def draw(*shape: int) -> torch.Tensor:
        return 2 * torch.rand(count, *shape, generator=random) - 1

    return EncodedBatch(
        EncodedInputs(draw(conditions), draw(TF_SAMPLES), draw(3, TF_SAMPLES)),
        opacity_image=draw(1, size.opacity_size, size.opacity_size),
        image=draw(3, size.image_size, size.image_size),
    )


def _fastest(
    steps_of: Callable[[Execution], Iterator[float]], device: torch.device, precision: str
) -> Execution:
    """Time steps of all candidates in turn, so that other load affects all of them alike."""
    running: dict[Execution, Iterator[float]] = {}
    for way in _ways(device, precision):
        steps = steps_of(way)
        try:
            for _ in range(1 + FIRST_PASSES * way.recorded):
                next(steps)
        except Exception:
            # torch.compile raises many kinds of errors if a dependency is missing, recording
            # where a driver cannot.
            if not (way.compiled or way.recorded):
                raise
        else:
            running[way] = steps
    # A busy machine makes steps longer, never shorter.
    quickest = dict.fromkeys(running, math.inf)
    end = time.perf_counter() + RUN_SECONDS
    rounds = 0
    while time.perf_counter() < end and len(running) > 1:
        for way, steps in running.items():
            quickest[way] = min(quickest[way], next(steps))
        rounds += 1
        if rounds >= LEAST_STEPS:
            limit = HOPELESS * min(quickest.values())
            running = {w: steps for w, steps in running.items() if quickest[w] < limit}
    # Among equally fast candidates, the first in order of preference.
    return next(way for way in quickest if quickest[way] <= ALIKE * min(quickest.values()))


def _ways(device: torch.device, precision: str) -> list[Execution]:
    """Return candidate settings for a device, in order of preference."""
    precisions: list[Precision] = ["bfloat16", "float32"]
    if precision != "auto":
        precisions = [p for p in precisions if p == precision]
    elif bfloat16_is_slow(device):
        precisions = ["float32"]
    ways = [Execution(p, last) for p, last in product(precisions, (True, False))]
    ways.append(replace(ways[0], fused=False))
    if device.type == "cuda":
        # On CPUs it takes a minute, and its steps are slower (docs/training.md).
        ways.append(replace(ways[0], compiled=True))
        ways.append(replace(ways[0], recorded=True))
    return ways


def bfloat16_is_slow(device: torch.device) -> bool:
    """Return True if a device emulates bfloat16, by the times of a convolution.

    Takes some 100 ms; a whole step in emulated bfloat16 would take seconds. On GPUs
    nothing is timed: bfloat16 counts as slow if it is unsupported.
    """
    if device.type == "cuda":
        return not torch.cuda.is_bf16_supported()
    torch.manual_seed(0)
    layer = nn.Conv2d(32, 32, 3, padding=1)
    image = torch.rand(8, 32, 32, 32)

    def seconds(precision: torch.dtype) -> float:
        start = time.perf_counter()
        with torch.autocast("cpu", precision, precision != torch.float32):
            layer(image).float().square().mean().backward()
        return time.perf_counter() - start

    # In turn, so that other load affects both alike.
    times = [(seconds(torch.bfloat16), seconds(torch.float32)) for _ in range(8)]
    bfloat16, float32 = map(min, zip(*times, strict=True))
    return bfloat16 > EMULATED * float32
