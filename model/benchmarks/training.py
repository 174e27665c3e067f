"""Speed of training steps by precision, memory order, optimizer, compilation and batch size."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from statistics import median
from typing import get_args

import torch

from model.networks.names import Precision
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.batch import encode_batch
from model.training.execution import Execution
from model.training.execution_choice import LATE, choose_execution, step_seconds
from model.training.options import TrainingOptions
from model.training.schedule import Schedule
from model.training.streamed_samples import StreamSource

WARM_UP_STEPS = 3


@dataclass(frozen=True)
class TrainingRow:
    """Measurements of one choice of execution settings.

    Attributes
    ----------
    chosen : bool
        Whether ``train`` uses these settings on this machine.
    seconds : float
        Time per step: the median of steps alone, the mean of a run's.
    speedup : float
        Speedup over the first settings of that stage, per sample.
    rendered : bool
        Whether samples were rendered beside the steps, as in a run.
    """

    stage: str
    execution: Execution
    chosen: bool
    batch_size: int
    seconds: float
    speedup: float
    rendered: bool = False


def compare_training(
    size: NetworkSize, options: TrainingOptions, scene: Scene, device: torch.device, steps: int
) -> Iterator[TrainingRow]:
    """Time the optimization steps of each stage.

    Parameters
    ----------
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
            seconds = _median(durations, steps)
            plainest = plainest or seconds
            yield TrainingRow(name, way, way == chosen, batch_size, seconds, plainest / seconds)


def compare_batches(
    size: NetworkSize,
    options: TrainingOptions,
    scene: Scene,
    volume: Volume,
    device: torch.device,
    steps: int,
    batch_sizes: Sequence[int],
) -> Iterator[TrainingRow]:
    """Time the steps of each stage that learns from images, by the number of samples in a batch.

    Parameters
    ----------
    volume : Volume
        The scene's.
    steps : int
        Number of steps that are timed, after a few that are not.

    Yields
    ------
    TrainingRow
        For each stage and batch size: the steps alone, then with samples rendered
        beside them as in a run.
    """
    way = choose_execution(size, options, scene, device)
    for name in Schedule(size, options, scene, device).names:
        first: float | None = None
        for batch_size in batch_sizes:
            changed = replace(getattr(options, name), batch_size=batch_size)
            asked = replace(options, **{name: changed})
            rest = size, asked, scene, device, way, name
            for rendered in (False, True):
                if rendered:
                    seconds = _seconds_of_a_run(volume, *rest, steps=steps) / batch_size
                else:
                    seconds = _median(step_seconds(*rest), steps) / batch_size
                first = first or seconds
                yield TrainingRow(
                    name, way, True, batch_size, seconds * batch_size, first / seconds, rendered
                )


def _seconds_of_a_run(
    volume: Volume,
    size: NetworkSize,
    options: TrainingOptions,
    scene: Scene,
    device: torch.device,
    execution: Execution,
    name: str,
    steps: int,
) -> float:
    """Mean seconds of a run's steps, with their samples and their encoding.

    A run renders a few hundred samples beforehand. The time begins once these are there,
    and it is a mean, as a block of samples is rendered every few steps only.
    """
    stage = Schedule(size, options, scene, device, execution).stages[name]
    source = StreamSource(volume, scene, options.seed)
    try:
        samples = source.batches(0, stage.stage.batch_size, options.seed, 0, stage.image_size)

        def go_on(count: int) -> None:
            for batch in islice(samples, count):
                stage.step(encode_batch(batch, scene, size.opacity_size, device), LATE)

        go_on(WARM_UP_STEPS)
        source.wait_until_ahead()
        before = time.perf_counter()
        go_on(steps)
        return (time.perf_counter() - before) / steps
    finally:
        source.close()


def _median(durations: Iterator[float], steps: int) -> float:
    return median(islice(durations, WARM_UP_STEPS, WARM_UP_STEPS + steps))


def _ways(device: torch.device, chosen: Execution) -> list[Execution]:
    ways = [Execution("float32", False, False)]
    ways += [Execution(p, last) for p in get_args(Precision) for last in (False, True)]
    if device.type == "cuda" or shutil.which("c++"):
        ways.append(replace(chosen, compiled=True))
    return ways if chosen in ways else [*ways, chosen]
