"""Cost of sensitivities, relative to an image by the same engine, in one run."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.generator.generator import Generator
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting, Scene
from model.scene.tf_perturbation import EDIT_WIDTH, edit_around
from model.scene.volume import Volume
from model.sensitivity.exact import visibility
from model.sensitivity.learned import Sensitivity
from model.sensitivity.rendered import region_responses

PAPER_RESOLUTIONS = (8, 16)
"""Blocks along each side, by which the paper makes fields."""

IMAGE = "image"


@dataclass(frozen=True)
class SensitivityCost:
    """Time of one kind of answer.

    Attributes
    ----------
    engine : {"exact", "learned"}
    size : int
        Width and height of the image in pixels.
    ms : float
        Median time.
    images : float
        The same relative to an image of this engine at this size.
    """

    engine: str
    question: str
    size: int
    ms: float
    images: float

    def to_json(self) -> dict[str, Any]:
        """Return the measurement as plain data."""
        return asdict(self)


def exact_costs(
    volume: Volume, lighting: Lighting, size: int, count: int, seed: int = 0
) -> list[SensitivityCost]:
    """Time the ray caster's sensitivities.

    Parameters
    ----------
    lighting : {"none", "direct", "shadows"}
    size : int
        Width and height of images in pixels.
    count : int
        Number of random views and TFs.
    """
    scene = Scene.of(volume, size, lighting)
    samples = [draw_sample(scene, seed, "holdout", index) for index in range(count)]
    edit = edit_around(sum(scene.scalar_window) / 2, volume.scalar_range, EDIT_WIDTH)
    whole = Region.whole(size)
    quarter = Region(size // 4, size // 4, 3 * size // 4, 3 * size // 4)
    renderer = RaycastRenderer(volume, lighting, scene.light)

    def region(inputs: SceneInputs, part: Region, measure: Any) -> object:
        return region_responses(renderer, inputs, size, part, EDIT_WIDTH, measure)

    ways: dict[str, Callable[[SceneInputs], object]] = {
        IMAGE: lambda inputs: renderer.render(inputs, size),
        "region, signed": lambda inputs: region(inputs, whole, "signed"),
        "region, change": lambda inputs: region(inputs, whole, "change"),
        "a quarter, change": lambda inputs: region(inputs, quarter, "change"),
        "value": lambda inputs: renderer.change(inputs, size, edit),
        "visibility": lambda inputs: visibility(renderer, inputs, size, whole),
    }
    try:
        return _costs("exact", ways, samples, size)
    finally:
        renderer.close()


def learned_costs(generator: Generator, count: int, seed: int = 0) -> list[SensitivityCost]:
    """Time a generator's sensitivities, and the paper's way, block by block.

    An image is a forward pass of the same network, without another backend's help.
    """
    scene = generator.scene
    size = scene.image_size
    samples = [draw_sample(scene, seed, "holdout", index) for index in range(count)]
    edit = edit_around(sum(scene.scalar_window) / 2, scene.scalar_range, EDIT_WIDTH)
    whole = Region.whole(size)
    ways: dict[str, Callable[[SceneInputs], object]] = {
        IMAGE: lambda inputs: generator.render(inputs),
        "region, signed": lambda inputs: Sensitivity(generator, inputs).region(whole),
        "region, change": lambda inputs: Sensitivity(generator, inputs).change_norms(whole),
        "value": lambda inputs: Sensitivity(generator, inputs).change(edit),
    }
    for resolution in PAPER_RESOLUTIONS:
        ways[f"value, {resolution} x {resolution} blocks (paper)"] = partial(
            _blockwise, generator, -(-size // resolution), edit
        )
    return _costs("learned", ways, samples, size)


def _blockwise(
    generator: Generator, block: int, edit: NDArray[np.float32], inputs: SceneInputs
) -> object:
    return Sensitivity(generator, inputs).blockwise_change(block, edit)


def _costs(
    engine: str,
    ways: dict[str, Callable[[SceneInputs], object]],
    samples: list[SceneInputs],
    size: int,
) -> list[SensitivityCost]:
    """Time all ways in turn on each sample; the first round includes compilation."""
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for sample in (samples[0], *samples):
        for name, way in ways.items():
            start = time.perf_counter()
            way(sample)
            taken[name].append(time.perf_counter() - start)
    medians = {name: median(times[1:]) for name, times in taken.items()}
    return [
        SensitivityCost(engine, name, size, 1000 * seconds, seconds / medians[IMAGE])
        for name, seconds in medians.items()
    ]
