"""What may stand in for the sensitivity of path-traced pictures: agreement with it, and time.

The truth are differences of pictures of many samples, whose paths are the same before and after an
edit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.generator.path_light_generator import cleaning_of
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import Renderer
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting
from model.scene.tf_perturbation import edit_around
from model.scene.volume import Volume
from model.sensitivity import differences, rendered
from model.sensitivity.cosine import cosine

WIDTH = 16.0
"""Standard deviation of edits in bins: 17 of them, by two pictures each."""

LIGHTS: tuple[Lighting, ...] = ("none", "direct", "shadows", "soft")

FEW = (1, 4)
"""Samples of generated pictures."""

Regions = Callable[[SceneInputs, Region], NDArray[np.float32]]
Fields = Callable[[SceneInputs, NDArray[np.float32]], NDArray[np.float32]]


@dataclass(frozen=True)
class StandInRow:
    """How well one way answers for one scene.

    Attributes
    ----------
    scene : int
        Its number.
    way : str
        A light of the ray caster, or the generator's pictures of some samples.
    whole, middle : float
        Cosine of the curve over the scalar values to that of the truth, of the whole picture and
        of the square in its middle.
    field : float
        Cosine of the field of the value that the whole picture changes most with.
    seconds : float
        Of the whole picture's curve.
    """

    scene: int
    way: str
    whole: float
    middle: float
    field: float
    seconds: float


def stand_in_rows(
    volume: Volume, scenes: list[SceneInputs], size: int, truth: int
) -> Iterator[StandInRow]:
    """Compare all ways with the truth, for each scene.

    Parameters
    ----------
    size : int
        Width and height of the pictures in pixels.
    truth : int
        Samples of each pixel of the pictures whose differences are the truth.
    """
    whole = Region(0, 0, size, size)
    middle = Region(size // 4, size // 4, size - size // 4, size - size // 4)
    with ExitStack() as stack:
        exact = _by_differences(_closed(stack, PathTracer(volume, samples=truth, seed=1)), size)
        ways = _ways(volume, size, stack)
        for number, inputs in enumerate(scenes):
            right = [exact[0](inputs, region) for region in (whole, middle)]
            lo, hi = volume.scalar_range
            value = lo + (hi - lo) * int(np.argmax(np.abs(right[0]))) / (len(right[0]) - 1)
            edit = edit_around(value, volume.scalar_range, WIDTH)
            field = exact[1](inputs, edit)
            for way, (curve, change) in ways.items():
                begun = time.perf_counter()
                found = [curve(inputs, whole)]
                seconds = time.perf_counter() - begun
                found.append(curve(inputs, middle))
                of_whole, of_middle = (cosine(*each) for each in zip(found, right, strict=True))
                alike = cosine(change(inputs, edit).ravel(), field.ravel())
                yield StandInRow(number, way, of_whole, of_middle, alike, seconds)


def _ways(volume: Volume, size: int, stack: ExitStack) -> dict[str, tuple[Regions, Fields]]:
    ways: dict[str, tuple[Regions, Fields]] = {}
    for lighting in LIGHTS:
        caster = RaycastRenderer(volume, lighting)
        stack.callback(caster.close)
        ways[lighting] = _of_caster(caster, size)
    cleaning, release = cleaning_of(volume)
    stack.callback(release)
    for samples in FEW:
        refining = RefiningRenderer(PathTracer(volume), cleaning, samples)
        name = f"generator, {samples} sample{'s' * (samples > 1)}"
        ways[name] = _by_differences(_closed(stack, refining), size)
    return ways


def _closed(stack: ExitStack, renderer: Renderer) -> Renderer:
    """Return a renderer that is closed at the end."""
    stack.callback(renderer.close)
    return renderer


def _by_differences(renderer: Renderer, size: int) -> tuple[Regions, Fields]:
    return (
        lambda inputs, region: differences.region_responses(renderer, inputs, size, region, WIDTH),
        lambda inputs, edit: differences.value_sensitivity(renderer, inputs, size, edit),
    )


def _of_caster(renderer: RaycastRenderer, size: int) -> tuple[Regions, Fields]:
    return (
        lambda inputs, region: rendered.region_responses(renderer, inputs, size, region, WIDTH),
        lambda inputs, edit: renderer.change(inputs, size, edit),
    )
