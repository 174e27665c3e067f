"""Exploration of the latent space (paper, sections 5.2 and 6.2, Figs. 10 and 11)."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from model.latent.codes import Codes, Opacities
from model.latent.latent_map import Brush, LatentMap
from model.latent.latent_space import draw_cells
from model.paper.subject import Image, Subject
from model.scene.inputs import SceneInputs

WHOLE_SHARE = 0.9  # side of the overview's rectangle, relative to the map's
DETAIL_SHARE = 0.22  # side of the detail's rectangle
CLOSER = 0.75  # distance of the second view, relative to the first one's
VISITED = 4  # places of a walk
CANDIDATES = 48  # samples among which a walk's places are chosen


@dataclass(frozen=True, eq=False)
class Place:
    """A place on the map: the code interpolated over a disc, its decoded TF (256,), its image."""

    place: tuple[float, float]
    radius: float
    code: Codes
    opacities: Opacities
    image: Image


@dataclass(frozen=True, eq=False)
class Exploration:
    """A brushed rectangle with the images (4, 4, S, S, 3) of its cells, and a place inside it."""

    inputs: SceneInputs
    map: LatentMap
    brush: Brush
    cells: Image
    hovered: Place


def overview(subject: Subject, map_: LatentMap, inputs: SceneInputs) -> Exploration:
    """Explore most of the map."""
    lowest, highest = map_.places.min(axis=0), map_.places.max(axis=0)
    middle, half = (lowest + highest) / 2, WHOLE_SHARE * (highest - lowest) / 2
    return _explored(subject, map_, inputs, middle, half)


def detail(subject: Subject, map_: LatentMap, first: Exploration) -> Exploration:
    """Explore a smaller part, in a closer view from the other side."""
    view = first.inputs.view
    nearer = max(CLOSER * view.distance, subject.generator.scene.view_range.nearest)
    turned = replace(view, azimuth=view.azimuth + 180, distance=nearer)
    extent = map_.places.max(axis=0) - map_.places.min(axis=0)
    middle = np.array(first.hovered.place)
    half = DETAIL_SHARE * extent / 2
    return _explored(subject, map_, replace(first.inputs, view=turned), middle, half)


def walk(
    subject: Subject, map_: LatentMap, inputs: SceneInputs, candidates: int = CANDIDATES
) -> list[Place]:
    """Visit the places with the most different pictures, from left to right.

    Each is farthest, by the pictures' RMSE, from those chosen before. The half with less contrast,
    nearly black pictures and opaque blocks, is excluded.
    """
    step = max(1, len(map_.codes) // candidates)
    chosen = np.arange(0, len(map_.codes), step)[:candidates]
    drawn = _drawn(subject, map_.codes[chosen], inputs)
    contrast = drawn[..., :3].std(axis=(1, 2, 3))
    shows = contrast >= np.median(contrast)
    if shows.sum() >= VISITED:
        chosen, drawn = chosen[shows], drawn[shows]
    flat = drawn[..., :3].reshape(len(drawn), -1)
    distance = np.square(flat - flat.mean(axis=0)).mean(axis=1)
    picked: list[int] = []
    for _ in range(min(VISITED, len(chosen))):
        picked.append(int(distance.argmax()))
        apart = np.square(flat - flat[picked[-1]]).mean(axis=1)
        distance = apart if len(picked) == 1 else np.minimum(distance, apart)
    places = map_.places[chosen[picked]]
    return [_place(subject, map_, inputs, p) for p in places[places[:, 0].argsort()]]


def _explored(
    subject: Subject,
    map_: LatentMap,
    inputs: SceneInputs,
    middle: NDArray[np.floating],
    half: NDArray[np.floating],
) -> Exploration:
    left, lower, right, upper = (float(x) for x in (*(middle - half), *(middle + half)))
    brush = left, lower, right, upper
    cells = map_.cells(brush)
    images = draw_cells(cells, partial(subject.generator.render_latent, inputs=inputs))[..., :3]
    # The mouse rests where most is visible.
    contrast = np.where(cells.count > 0, np.nan_to_num(images).std(axis=(2, 3, 4)), -1)
    row, column = np.unravel_index(contrast.argmax(), contrast.shape)
    hovered = _place(subject, map_, inputs, cells.places[row, column])
    return Exploration(inputs, map_, brush, images, hovered)


def _place(
    subject: Subject, map_: LatentMap, inputs: SceneInputs, place: NDArray[np.floating]
) -> Place:
    where = float(place[0]), float(place[1])
    code = map_.at(where).code
    opacities = subject.space.codec.decode(code[None])[0]
    image = _drawn(subject, code[None], inputs)[0, ..., :3]
    return Place(where, map_.radius, code, opacities, image)


def _drawn(subject: Subject, codes: Codes, inputs: SceneInputs) -> Image:
    batches = [
        subject.generator.render_latent(codes[first : first + 16], inputs)
        for first in range(0, len(codes), 16)
    ]
    return np.concatenate(batches)
