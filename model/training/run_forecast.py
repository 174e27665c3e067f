"""How long a training run of so many samples will take, from a few steps of each of its stages."""

from __future__ import annotations

import os
import time
from itertools import islice

import torch

from model.samples.sample_rendering import make_renderer, render_samples
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.execution import Execution
from model.training.execution_choice import step_seconds, timed_options
from model.training.job import TrainingJob
from model.training.schedule import Schedule
from model.training.streamed_samples import DEFAULT_REUSE

TIMED_STEPS = 2

RENDERED = 4
"""Samples that rendering is timed on."""


def forecast_run(
    job: TrainingJob,
    volume: Volume,
    device: torch.device,
    execution: Execution,
    rough: bool = False,
) -> float:
    """Estimate the seconds of a run whose budget is in samples; takes some seconds itself.

    Parameters
    ----------
    job : TrainingJob
        Its samples are rendered while it trains, unless it has a stored data set.
    execution : Execution
        How steps are computed.
    rough : bool
        Whether the first step of each stage, which also prepares what stays, is enough.

    Returns
    -------
    float
        Measuring and saving, a few seconds a minute, are left out.
    """
    assert job.samples is not None
    scene = job.scene_of(volume)
    options = timed_options(job.options, device)
    schedule = Schedule(job.size, options, scene, torch.device("cpu"))
    seconds, begun = 0.0, 0.0
    for name in schedule.names:
        share, begun = schedule.ends[name] - begun, schedule.ends[name]
        steps = step_seconds(job.size, options, scene, device, execution, name)
        # The first step also prepares what stays.
        times = [next(steps)] if rough else list(islice(steps, 1 + TIMED_STEPS))[1:]
        images = getattr(options, name).batch_size
        seconds += share * job.samples * min(times) / images
    if job.store is None and device.type == "cpu":
        fresh = job.samples / (job.reuse or DEFAULT_REUSE[job.lighting])
        seconds += fresh * _rendering_seconds(scene, volume) / (job.workers or os.cpu_count() or 1)
    return seconds


def _rendering_seconds(scene: Scene, volume: Volume) -> float:
    """Processor seconds of a rendered sample."""
    renderer = make_renderer(volume, scene, threads=1)
    try:
        render_samples(renderer, scene, 0, "train", range(1))
        start = time.perf_counter()
        render_samples(renderer, scene, 0, "train", range(RENDERED))
        return (time.perf_counter() - start) / RENDERED
    finally:
        renderer.close()
