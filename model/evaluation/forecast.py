"""How long an evaluation will take, from the time of a first sample of each of its parts."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from sklearn.metrics import pairwise_distances_argmin_min

from model.evaluation.holdout import generator_errors, image_errors
from model.generator.generator import Generator
from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sample_store import SampleBatch
from model.samples.sampling import draw_sample
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement

PROCESS_START_S = 4.0
"""Seconds until processes that render have imported what they need."""

SEARCHED = 64
"""Images among which so many are searched for, to time the search for neighbours."""

WAYS = 3
"""Ways of drawing that are compared."""


@dataclass(frozen=True)
class EvaluationParts:
    """Numbers of samples in the parts of an evaluation.

    Attributes
    ----------
    measured : int
        Hold-out samples.
    neighbors : int
        Training images that are searched for the nearest.
    rendered : int
        Samples that are rendered first.
    compared : int
        Samples that are also drawn by what could be used instead.
    differentiated : int
        Samples whose sensitivities are compared.
    """

    measured: int
    neighbors: int
    rendered: int
    compared: int
    differentiated: int


def forecast_seconds(
    generator: Generator,
    volume: Volume | None,
    parts: EvaluationParts,
    stored: SampleBatch | None,
    workers: int | None = None,
) -> float:
    """Estimate the time of an evaluation; takes a few seconds itself.

    Parameters
    ----------
    volume : Volume or None
        The scene's; may be None where nothing is rendered.
    stored : SampleBatch or None
        A sample or two of the scene; None renders them.
    workers : int or None
        Processes that render, one per processor by default.
    """
    seconds = 0.0
    scene, seed = generator.scene, int(generator.card.training.get("dataset_seed", 0))
    if stored is None or parts.rendered:
        assert volume is not None
        start = time.perf_counter()
        renderer = make_renderer(volume, scene)
        try:
            first = render_samples(renderer, scene, seed, "holdout", range(1))
            opened = time.perf_counter()
            second = render_samples(renderer, scene, seed, "holdout", range(1, 2))
            rendered = time.perf_counter() - opened
        finally:
            renderer.close()
        stored = SampleBatch.concatenate([first, second])
        # VTK takes all processors for each image.
        processes = 1 if scene.renderer == "vtk" else workers or os.cpu_count() or 1
        seconds += PROCESS_START_S + opened - start + parts.rendered * rendered / processes
    else:
        rendered = 0.0
    truth = stored.rgba[0] / 255
    seconds += parts.measured * (
        _time(lambda: generator_errors(generator, stored)) / len(stored)
        + _time(lambda: image_errors(stored.rgba[-1, ..., :3] / 255, truth))
        + _search_seconds(scene.image_size) * parts.neighbors
    )
    if volume is not None:
        metrics = _time(lambda: image_errors(truth[..., :3], truth))
        seconds += parts.compared * WAYS * metrics
        if scene.is_scattering:
            seconds += min(parts.compared, 4) * rendered
    if volume is not None and parts.differentiated:
        sample = draw_sample(scene, seed, "holdout", 0)
        seconds += parts.differentiated * _time(
            lambda: sensitivity_agreement(generator, volume, [sample])
        )
    return seconds


def _time(work: Callable[[], object]) -> float:
    """Seconds of the second call: the first one also prepares what stays."""
    work()
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _search_seconds(size: int) -> float:
    """Seconds to compare one image with one other, for the nearest of many."""
    images = np.random.default_rng(0).random((SEARCHED, 3 * size**2), dtype=np.float32)
    return _time(lambda: pairwise_distances_argmin_min(images, images)) / SEARCHED**2
