"""How fast a stage of training learns, by precision, memory order, optimiser and compilation."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median
from typing import NamedTuple

import torch

from model.encoding import EncodedBatch
from model.networks.blocks import VIEW_PARAMETERS, NetworkSize
from model.scene import Scene
from model.training.options import TrainingOptions
from model.training.schedule import Schedule
from model.training.stage import Stage
from model.transfer_function import TF_SAMPLES

WARM_UP_STEPS = 3


@dataclass(frozen=True)
class TrainingRow:
    """One way to do the same steps.

    Attributes
    ----------
    stage : str
    precision : str
        "float32" or "bfloat16".
    channels_last : bool
        Order of the convolutions' weights and images in memory.
    fused : bool
        Whether the optimiser moves all weights in one go.
    compiled : bool
    batch_size : int
    seconds : float
        Median time of a step.
    speedup : float
        Over the first way of that stage.
    """

    stage: str
    precision: str
    channels_last: bool
    fused: bool
    compiled: bool
    batch_size: int
    seconds: float
    speedup: float


class _Way(NamedTuple):
    precision: torch.dtype
    channels_last: bool
    fused: bool = True
    compiled: bool = False


def compare_training(
    size: NetworkSize, options: TrainingOptions, scene: Scene, device: torch.device, steps: int
) -> Iterator[TrainingRow]:
    """Time the optimisation steps of each stage.

    Parameters
    ----------
    size : NetworkSize
    options : TrainingOptions
    scene : Scene
    device : torch.device
    steps : int
        That are timed, after a few that are not.

    Yields
    ------
    TrainingRow
        For each stage, the plainest way first; compiled ones where there is a
        C++ compiler.
    """
    for name in Schedule(size, options, scene, device).names:
        plainest: float | None = None
        for way in _ways(device):
            # Each way starts from the same first weights.
            stage = Schedule(size, options, scene, device).stages[name]
            seconds = _time(stage, size, way, steps)
            plainest = plainest or seconds
            yield TrainingRow(
                name,
                str(way.precision).removeprefix("torch."),
                way.channels_last,
                way.fused,
                way.compiled,
                stage.stage.batch_size,
                seconds,
                plainest / seconds,
            )


def _ways(device: torch.device) -> list[_Way]:
    ways = [_Way(torch.float32, False, fused=False)]
    ways += [_Way(p, last) for p in (torch.float32, torch.bfloat16) for last in (False, True)]
    if device.type == "cuda" or shutil.which("c++"):
        ways.append(_Way(torch.bfloat16, True, compiled=True))
    return ways


def _time(stage: Stage, size: NetworkSize, way: _Way, steps: int) -> float:
    stage.precision = way.precision
    order = torch.channels_last if way.channels_last else torch.contiguous_format
    for network in (stage.generator, stage.discriminator):
        network.to(memory_format=order)  # type: ignore[call-overload]
    for optimiser in (stage.generator_optimiser, stage.discriminator_optimiser):
        for group in optimiser.param_groups:
            group["fused"] = way.fused
    if way.compiled:
        stage._generate = torch.compile(stage._generate)  # type: ignore[method-assign]
    batch = _noise(stage.stage.batch_size, size).to(stage.device)
    durations = []
    for _ in range(WARM_UP_STEPS + steps):
        start = time.perf_counter()
        stage.step(batch, 0.0)  # ends with a number on the CPU: a GPU has finished then
        durations.append(time.perf_counter() - start)
    return median(durations[WARM_UP_STEPS:])


def _noise(count: int, size: NetworkSize) -> EncodedBatch:
    """A batch of random numbers: they take as long as images."""
    random = torch.Generator().manual_seed(0)

    def draw(*shape: int) -> torch.Tensor:
        return 2 * torch.rand(count, *shape, generator=random) - 1

    return EncodedBatch(
        view=draw(VIEW_PARAMETERS),
        opacity_tf=draw(TF_SAMPLES),
        color_tf=draw(3, TF_SAMPLES),
        opacity_image=draw(1, size.opacity_size, size.opacity_size),
        image=draw(3, size.image_size, size.image_size),
    )
