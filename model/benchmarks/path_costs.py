"""Cost of path-traced samples over opacity, bounces and processors."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from model.rendering.path_tracing.renderer import Lamp, PathTracer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import TF_SAMPLES, OpacityTF
from model.scene.volume import Volume

OPACITIES = 0.01, 0.1, 0.5, 1.0
"""Factors of the TF's opacities."""

BOUNCES = 1, 2, 8, 32

REPEATS = 3
"""Pictures of which the fastest counts."""


@dataclass(frozen=True)
class PathCost:
    """Time of one sample of each pixel.

    Attributes
    ----------
    opacity : float
        Factor of the TF's opacities.
    bounces : int
        Most collisions of a path.
    threads : int
    seconds : float
    shown : float
        Mean opacity of the picture.
    """

    opacity: float
    bounces: int
    threads: int
    seconds: float
    shown: float


def path_costs(volume: Volume, inputs: SceneInputs, size: int) -> Iterator[PathCost]:
    """Trace one sample a pixel with other opacities, bounces and threads, one after the other."""
    usual, processors = Lamp().bounces, os.cpu_count() or 1
    for factor in OPACITIES:
        yield _cost(volume, inputs, size, factor, usual, processors)
    for bounces in BOUNCES:
        yield _cost(volume, inputs, size, 1.0, bounces, processors)
    threads = 1
    while threads < processors:
        yield _cost(volume, inputs, size, 1.0, usual, threads)
        threads *= 2


def _fainter(opacity_tf: OpacityTF, factor: float) -> OpacityTF:
    """Return a TF with all opacities times a factor, as a curve."""
    lo, hi = opacity_tf.scalar_range
    values = np.linspace(lo, hi, TF_SAMPLES)
    points = zip(values.tolist(), (factor * opacity_tf(values)).tolist(), strict=True)
    return OpacityTF(opacity_tf.scalar_range, points=tuple(points), scale=opacity_tf.scale)


def _cost(
    volume: Volume, inputs: SceneInputs, size: int, factor: float, bounces: int, threads: int
) -> PathCost:
    inputs = replace(inputs, opacity_tf=_fainter(inputs.opacity_tf, factor))
    tracer = PathTracer(volume, lamp=Lamp(bounces=bounces), threads=threads)
    # Compiles, and classifies the volume.
    deque(tracer.refine(inputs, 16, 1), maxlen=0)
    seconds = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        (picture,) = tracer.refine(inputs, size, 1)
        seconds.append(time.perf_counter() - begun)
    tracer.close()
    return PathCost(factor, bounces, threads, min(seconds), float(picture.rgba[..., 3].mean()))
