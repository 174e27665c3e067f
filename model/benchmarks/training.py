"""Speed of training steps by precision, memory order, optimizer and compilation."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from statistics import median
from typing import get_args

import torch

from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.training.execution import Execution
from model.training.execution_choice import choose_execution, step_seconds
from model.training.options import Precision, TrainingOptions
from model.training.schedule import Schedule

WARM_UP_STEPS = 3


@dataclass(frozen=True)
class TrainingRow:
    """Measurements of one choice of execution settings.

    Attributes
    ----------
    stage : str
    execution : Execution
    chosen : bool
        Whether ``train`` uses these settings on this machine.
    batch_size : int
    seconds : float
        Median time per step.
    speedup : float
        Speedup over the first settings of that stage.
    """

    stage: str
    execution: Execution
    chosen: bool
    batch_size: int
    seconds: float
    speedup: float


def compare_training(
    size: NetworkSize, options: TrainingOptions, scene: Scene, device: torch.device, steps: int
) -> Iterator[TrainingRow]:
    """Time the optimization steps of each stage.

    Parameters
    ----------
    size : NetworkSize
    options : TrainingOptions
    scene : Scene
    device : torch.device
    steps : int
        Number of steps that are timed, after a few that are not.

    Yields
    ------
    TrainingRow
        For each stage, the plainest settings first; with ``torch.compile`` on GPUs,
        or if there is a C++ compiler.
    """
    chosen = choose_execution(size, options, scene, device)
    for name in Schedule(size, options, scene, device).names:
        batch_size = getattr(options, name).batch_size
        plainest: float | None = None
        for way in _ways(device, chosen):
            durations = step_seconds(size, options, scene, device, way, name)
            seconds = median(islice(durations, WARM_UP_STEPS, WARM_UP_STEPS + steps))
            plainest = plainest or seconds
            yield TrainingRow(name, way, way == chosen, batch_size, seconds, plainest / seconds)


def _ways(device: torch.device, chosen: Execution) -> list[Execution]:
    ways = [Execution("float32", False, False)]
    ways += [Execution(p, last) for p in get_args(Precision) for last in (False, True)]
    if device.type == "cuda" or shutil.which("c++"):
        ways.append(replace(chosen, compiled=True))
    return ways if chosen in ways else [*ways, chosen]
