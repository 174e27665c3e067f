"""Speed of the latent browser's parts, as ratios to single images in the same run."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.generator.generator import Generator
from model.latent.embedding import EmbeddingProcess
from model.latent.goal_search import Goal, GoalSearch, candidates_for
from model.latent.latent_map import LatentMap
from model.latent.latent_space import LatentSpace
from model.latent.opacity_overview import RayLengths
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.volume import Volume

REPEATS = 5
SEARCHES = 20
FIRST_BRUSH = (-0.8, -0.8, 0.8, 0.8)

Images = NDArray[np.float32]
Draw = Callable[[list[SceneInputs], int], Images]
"""Draws the images of some inputs at a size; a model ignores the size."""


@dataclass(frozen=True)
class LatentRow:
    """Times of one engine.

    Attributes
    ----------
    size : int
        Width and height of the images in pixels.
    image : float
        Seconds of a single image: the mean of the grid's 16.
    grid : float
        Seconds of the grid's 16 images in one batch.
    hover : float
        Seconds from a place to its image: interpolation, decoding and drawing.
    """

    engine: str
    size: int
    image: float
    grid: float
    hover: float


@dataclass(frozen=True)
class SearchRow:
    """Searches for the picture of a random TF.

    Attributes
    ----------
    errors : tuple of float
        RMSE of each search's picture from its goal's.
    images : tuple of int
        Pictures that each search looked at.
    """

    engine: str
    errors: tuple[float, ...]
    seconds: tuple[float, ...]
    images: tuple[int, ...]


@dataclass(frozen=True)
class MapRow:
    """Times of what does not draw, in seconds.

    Attributes
    ----------
    sampling, cells, blend, placement, overview : float
        Decoding and encoding all samples; means of the grid's cells; interpolation at a place;
        placing a TF; what all samples show in a view.
    tsne : float or None
        Computing the map's places; None if that was not asked for.
    """

    samples: int
    sampling: float
    cells: float
    blend: float
    placement: float
    overview: float
    tsne: float | None


def time_engine(
    name: str, draw: Draw, size: int, space: LatentSpace, map_: LatentMap, inputs: SceneInputs
) -> LatentRow:
    """Time grid and hover images of one engine; views and colours are those of some inputs."""
    cells = map_.cells(FIRST_BRUSH)
    codes = cells.codes[cells.count > 0]
    some = [replace(inputs, opacity_tf=space.tf_of(code)) for code in codes]
    draw(some, size)
    singles = _best(lambda: [draw([one], size) for one in some])
    grid = _best(lambda: draw(some, size))
    places = map_.places[:: max(len(map_.places) // 20, 1)][:20]

    def hover() -> None:
        for x, y in places.tolist():
            code = map_.at((x, y)).code
            draw([replace(inputs, opacity_tf=space.tf_of(code))], size)

    return LatentRow(name, size, singles / len(some), grid, _best(hover) / len(places))


def time_codes(name: str, generator: Generator, map_: LatentMap, inputs: SceneInputs) -> LatentRow:
    """Time the same of a generator that draws the map's codes themselves."""
    cells = map_.cells(FIRST_BRUSH)
    codes = cells.codes[cells.count > 0]
    generator.render_latent(codes, inputs)
    singles = _best(lambda: [generator.render_latent(code, inputs) for code in codes])
    grid = _best(lambda: generator.render_latent(codes, inputs))
    places = map_.places[:: max(len(map_.places) // 20, 1)][:20]

    def hover() -> None:
        for x, y in places.tolist():
            # The decoded TF is shown beside the image.
            code = map_.at((x, y)).code
            generator.decode(code)
            generator.render_latent(code, inputs)

    size = generator.scene.image_size
    return LatentRow(name, size, singles / len(codes), grid, _best(hover) / len(places))


def time_map(
    volume: Volume, space: LatentSpace, map_: LatentMap, inputs: SceneInputs, with_tsne: bool
) -> MapRow:
    """Time sampling, browsing, placement, overview and, if asked for, t-SNE."""
    codes = map_.codes
    tfs = space.frame.stretched(map_.samples.tfs)
    place = (float(map_.places[0, 0]), float(map_.places[0, 1]))
    map_.place(codes[0])

    def placement() -> None:
        map_.place(space.code_of(inputs.opacity_tf))

    tsne = None
    if with_tsne:
        start = time.perf_counter()
        EmbeddingProcess(codes).run()
        tsne = time.perf_counter() - start
    return MapRow(
        len(codes),
        _best(lambda: space.codec.encode(space.codec.decode(codes))),
        _best(lambda: map_.cells(FIRST_BRUSH)),
        _best(lambda: map_.at(place)),
        _best(placement),
        _best(lambda: RayLengths.of(volume, inputs.view).overview(tfs)),
        tsne,
    )


def time_searches(
    name: str,
    draw: Draw,
    size: int,
    volume: Volume,
    space: LatentSpace,
    map_: LatentMap,
    scene: Scene,
    seed: int,
) -> SearchRow:
    """Search for the pictures of random TFs in random views; all are told, none chosen."""
    tfs = space.frame.stretched(map_.samples.tfs)
    errors, seconds, images = [], [], []
    for index in range(SEARCHES):
        wanted = draw_sample(scene, seed, "holdout", index)
        goal = Goal.like(draw([wanted], size)[0])
        start = time.perf_counter()
        opacities = RayLengths.of(volume, wanted.view).opacity_images(tfs)
        search = GoalSearch(goal, candidates_for(goal, None, map_.codes, opacities), map_.codes)
        count = 0
        while not search.is_done:
            asked = [replace(wanted, opacity_tf=space.tf_of(code)) for code in search.question]
            search.answer(draw(asked, size))
            count += len(asked)
        assert search.found is not None
        errors.append(search.found.error)
        seconds.append(time.perf_counter() - start)
        images.append(count)
    return SearchRow(name, tuple(errors), tuple(seconds), tuple(images))


def _best(task: Callable[[], Any]) -> float:
    """Least of some measurements, in seconds."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        task()
        times.append(time.perf_counter() - start)
    return min(times)
