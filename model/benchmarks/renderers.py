"""Speed and accuracy of the renderers, measured side by side on this machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.metrics import rmse
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import Renderer, open_renderer
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting, RendererName, Scene
from model.scene.tf_perturbation import EDIT_WIDTH, edit_around
from model.scene.volume import Volume
from model.sensitivity.exact import region_sensitivity, sensitivity_field

SAMPLE_DISTANCES = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Sample distances to compare, in voxels."""

REFERENCE_DISTANCE: dict[Lighting, float] = {
    "none": 1 / 16,
    "direct": 1 / 16,
    "soft": 1 / 16,
    "shadows": 1 / 4,
}
"""Sample distance of VTK's reference images, in voxels; larger for VTK's slow shadows."""

RENDERERS: tuple[RendererName, ...] = ("vtk", "raycast")

FIELD_BLOCK = 16
"""Block size in pixels of the sensitivity field that is timed."""


@dataclass(frozen=True)
class RendererRow:
    """Measurements of both renderers at one sample distance, averaged over views and TFs.

    Attributes
    ----------
    sample_distance : float
        In voxels.
    images_per_second : dict of float
        By renderer.
    error : dict of float
        Image RMSE against VTK at the reference distance, by renderer; rounding to
        8 bits alone gives 0.001.
    difference, worst_difference : float
        Image RMSE between the two renderers: mean and largest.
    """

    sample_distance: float
    images_per_second: dict[str, float]
    error: dict[str, float]
    difference: float
    worst_difference: float

    @property
    def speedup(self) -> float:
        """Ratio of the ray caster's images per second to VTK's."""
        return self.images_per_second["raycast"] / self.images_per_second["vtk"]


@dataclass(frozen=True)
class RendererComparison:
    """Comparison of the renderers on one volume.

    Attributes
    ----------
    count, size : int
        Number of views and TFs; width and height of images in pixels.
    derivative_costs : dict of float
        Time of derivatives by what is differentiated, relative to that of an image, at the
        scene's sample distance.
    reference_distance : float
        Sample distance of VTK's reference images, in voxels.
    cells_share : float
        Memory of the min-max cells, relative to that of the volume.
    """

    volume: str
    dimensions: tuple[int, int, int]
    lighting: str
    count: int
    size: int
    rows: tuple[RendererRow, ...]
    derivative_costs: dict[str, float]
    reference_distance: float
    cells_share: float

    def to_json(self) -> dict[str, Any]:
        """Return the measurements as plain data."""
        data = asdict(self)
        for row, plain in zip(self.rows, data["rows"], strict=True):
            plain["speedup"] = row.speedup
        return data


def compare_renderers(
    volume: Volume,
    scene: Scene,
    count: int,
    seed: int = 0,
    distances: Sequence[float] | None = None,
    reference_distance: float | None = None,
    preintegrated: bool = False,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> RendererComparison:
    """Time both renderers alternately on the same images and measure their errors.

    Parameters
    ----------
    scene : Scene
        Gives image size and lighting; views and TFs are drawn as for training.
    distances : sequence of float, optional
        Sample distances in voxels; by default those of :data:`SAMPLE_DISTANCES` above
        the reference distance.
    reference_distance : float, optional
        Sample distance of VTK's reference images, in voxels.
    preintegrated : bool
        Whether the ray caster integrates the TFs over each step.
    on_progress : callable
        Called with the numbers of images done and in total.
    """
    samples = [draw_sample(scene, seed, "holdout", i) for i in range(count)]
    raycast = RaycastRenderer(volume, scene.lighting, scene.light, preintegrated=preintegrated)
    renderers: dict[str, Renderer] = {
        "vtk": open_renderer("vtk", volume, scene.lighting, scene.light),
        "raycast": raycast,
    }
    reference_distance = reference_distance or REFERENCE_DISTANCE[scene.lighting]
    distances = distances or [d for d in SAMPLE_DISTANCES if d > reference_distance]
    total = count * (2 * len(distances) + 1)
    done = 0

    def draw(
        name: RendererName, sample: SceneInputs, distance: float
    ) -> tuple[NDArray[Any], float]:
        nonlocal done
        image, seconds = _timed(renderers[name], sample, distance, scene.image_size)
        done += 1
        on_progress(done, total)
        return image, seconds

    try:
        for renderer in renderers.values():
            # The first image includes the compilation of shaders and kernels.
            _timed(renderer, samples[0], scene.sample_distance, scene.image_size)
        references = [draw("vtk", sample, reference_distance)[0] for sample in samples]
        rows = tuple(_measure(draw, samples, references, distance) for distance in distances)
        raycast.sample_distance = scene.sample_distance
        costs = _derivative_costs(raycast, samples, scene)
    finally:
        for renderer in renderers.values():
            renderer.close()
    return RendererComparison(
        volume=volume.name,
        dimensions=volume.dimensions,
        lighting=scene.lighting,
        count=count,
        size=scene.image_size,
        rows=rows,
        derivative_costs=costs,
        reference_distance=reference_distance,
        cells_share=raycast.cells.nbytes / volume.scalars.nbytes,
    )


def _timed(
    renderer: Renderer, sample: SceneInputs, distance: float, size: int
) -> tuple[NDArray[np.float32], float]:
    """Return an image's colours (S, S, 3) and its rendering time in seconds."""
    renderer.sample_distance = distance
    start = time.perf_counter()
    image = renderer.render(sample, size)
    return image[..., :3], time.perf_counter() - start


def _measure(
    draw: Callable[[RendererName, SceneInputs, float], tuple[NDArray[Any], float]],
    samples: list[SceneInputs],
    references: list[NDArray[np.float32]],
    distance: float,
) -> RendererRow:
    seconds: dict[str, list[float]] = {name: [] for name in RENDERERS}
    errors: dict[str, list[float]] = {name: [] for name in RENDERERS}
    differences = []
    for sample, reference in zip(samples, references, strict=True):
        images = {}
        for name in RENDERERS:
            images[name], taken = draw(name, sample, distance)
            seconds[name].append(taken)
            errors[name].append(rmse(images[name], reference))
        differences.append(rmse(images["vtk"], images["raycast"]))
    return RendererRow(
        sample_distance=distance,
        images_per_second={name: 1 / fmean(seconds[name]) for name in RENDERERS},
        error={name: fmean(errors[name]) for name in RENDERERS},
        difference=fmean(differences),
        worst_difference=max(differences),
    )


def _derivative_costs(
    renderer: RaycastRenderer, samples: list[SceneInputs], scene: Scene
) -> dict[str, float]:
    """Return the time of derivatives relative to that of images."""
    size, distance = scene.image_size, scene.sample_distance
    middle = sum(scene.scalar_window) / 2
    edit = edit_around(middle, scene.scalar_range, EDIT_WIDTH)
    whole = Region.whole(size)
    ways: dict[str, Callable[[SceneInputs], object]] = {
        "one value": lambda s: renderer.change(s, size, edit),
        "whole image": lambda s: region_sensitivity(renderer, s, size, whole),
    }
    if renderer.differentiates_windows:
        ways["16 x 16 blocks"] = lambda s: sensitivity_field(renderer, s, size, FIELD_BLOCK)
    rendering, differentiating = 0.0, dict.fromkeys(ways, 0.0)
    for number, sample in enumerate([samples[0], *samples]):
        taken = {"image": _timed(renderer, sample, distance, size)[1]}
        for name, differentiate in ways.items():
            start = time.perf_counter()
            differentiate(sample)
            taken[name] = time.perf_counter() - start
        if number:
            # The first one includes compilation and is not counted.
            rendering += taken["image"]
            for name in ways:
                differentiating[name] += taken[name]
    return {name: seconds / rendering for name, seconds in differentiating.items()}
