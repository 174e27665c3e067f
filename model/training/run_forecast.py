"""How long a training run of so many samples will take, from a few steps of each of its stages."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from itertools import islice

import torch

from model.samples.sample_rendering import make_renderer, render_samples
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.execution import Execution
from model.training.execution_choice import step_seconds
from model.training.job import TrainingJob
from model.training.options import TrainingOptions
from model.training.schedule import Schedule
from model.training.streamed_samples import DEFAULT_REUSE

TIMED_IMAGES = 4
"""Images of a timed step on a CPU, where a step takes as long as its images together."""

TIMED_STEPS = 2

RENDERED = 4
"""Samples that rendering is timed on."""


def forecast_run(
    job: TrainingJob, volume: Volume, device: torch.device, execution: Execution
) -> float:
    """Estimate the seconds of a run whose budget is in samples; takes some seconds itself.

    Parameters
    ----------
    job : TrainingJob
        Its samples are rendered while it trains, unless it has a stored data set.
    execution : Execution
        How steps are computed.

    Returns
    -------
    float
        Measuring and saving, a few seconds a minute, are left out.
    """
    assert job.samples is not None
    scene = job.scene_of(volume)
    options = job.options
    schedule = Schedule(job.size, options, scene, torch.device("cpu"))
    seconds, begun = 0.0, 0.0
    for name in schedule.names:
        share, begun = schedule.ends[name] - begun, schedule.ends[name]
        batch = getattr(options, name).batch_size
        timed = batch if device.type == "cuda" else min(batch, TIMED_IMAGES)
        steps = step_seconds(
            job.size, _with_batch(options, name, timed), scene, device, execution, name
        )
        # The first step also prepares what stays.
        quickest = min(list(islice(steps, 1 + TIMED_STEPS))[1:])
        seconds += share * job.samples * quickest / timed
    if job.store is None and device.type == "cpu":
        fresh = job.samples / (job.reuse or DEFAULT_REUSE[job.lighting])
        seconds += fresh * _rendering_seconds(scene, volume) / (job.workers or os.cpu_count() or 1)
    return seconds


def _with_batch(options: TrainingOptions, name: str, size: int) -> TrainingOptions:
    stage = replace(getattr(options, name), batch_size=size)
    return replace(options, **{name: stage})


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
