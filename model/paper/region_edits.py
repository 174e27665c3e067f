"""Region sensitivity plots that drive two edits (paper, section 6.1 and Fig. 8)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from model.paper.edits import rms_change, suggested_mode, with_mode
from model.paper.subject import Image, Subject
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.tf_perturbation import EDIT_WIDTH
from model.scene.transfer_function import GaussianMode
from model.sensitivity.display import shown_responses
from model.sensitivity.learned import Sensitivity

BLOCKS = 16
"""Blocks along each side by which regions are chosen."""

REGION_BLOCKS = 4
"""Blocks along each side of a region."""

LEAST_BRIGHTNESS = 0.35
"""Brightness of the second region, of the first one's, from which on it is chosen."""


@dataclass(frozen=True, eq=False)
class RegionStep:
    """One row of the figure.

    Attributes
    ----------
    drawn, truth : ndarray, shape (S, S, 3)
        The model's image and the true one.
    region : Region or None
        None in the last row, which shows what the second edit did.
    responses : ndarray of float64, shape (256,), or None
        The region's sensitivity, in the displayed unit; see
        :func:`model.sensitivity.display.shown_responses`.
    mode : GaussianMode or None
        The mode that is then added.
    changes : tuple of 2 float, or None
        RMS change of the region's colours by that mode: in the model's images, and in the
        true ones.
    """

    inputs: SceneInputs
    drawn: Image
    truth: Image
    region: Region | None = None
    responses: NDArray[np.float64] | None = None
    mode: GaussianMode | None = None
    changes: tuple[float, float] | None = None


def region_edits(subject: Subject, inputs: SceneInputs) -> list[RegionStep]:
    """Select two regions that react differently, and add to each what its plot suggests."""
    found = Sensitivity(subject.generator, inputs)
    regions = two_regions(found.image, found.field(subject.size // BLOCKS))
    steps, mode = [], None
    for region in regions:
        sensitivity = Sensitivity(subject.generator, inputs)
        mask = region.mask(subject.size)
        responses = shown_responses(sensitivity.region(region), int(mask.sum()), EDIT_WIDTH)
        mode = suggested_mode(subject.generator.scene, inputs, responses, mode)
        edited = with_mode(inputs, mode)
        drawn, truth = subject.drawn(inputs), subject.truth(inputs)
        changes = (
            rms_change(drawn, subject.drawn(edited), mask),
            rms_change(truth, subject.truth(edited), mask),
        )
        steps.append(RegionStep(inputs, drawn, truth, region, responses, mode, changes))
        inputs = edited
    return [*steps, RegionStep(inputs, subject.drawn(inputs), subject.truth(inputs))]


def two_regions(image: Image, fields: NDArray[np.floating]) -> tuple[Region, Region]:
    """Choose the brightest square of an image, and one apart from it that reacts otherwise."""
    count = len(fields)
    block = len(image) // count
    brightness = np.square(image).mean(axis=2).reshape(count, block, count, block).mean((1, 3))
    sides = range(count - REGION_BLOCKS + 1)
    places = list(product(sides, sides))
    light = [_sum(brightness, place) for place in places]
    reactions = np.stack([_sum(fields, place) for place in places])
    reactions /= np.linalg.norm(reactions, axis=1, keepdims=True) + 1e-12
    first = int(np.argmax(light))
    likeness = reactions @ reactions[first]
    apart = [
        index
        for index, place in enumerate(places)
        if max(abs(a - b) for a, b in zip(place, places[first], strict=True)) >= REGION_BLOCKS
    ]
    seen = [i for i in apart if light[i] >= LEAST_BRIGHTNESS * light[first]] or apart
    second = min(seen, key=lambda index: likeness[index])
    return _region(places[first], block), _region(places[second], block)


def _sum(values: NDArray[np.floating], place: tuple[int, int]) -> NDArray[np.floating]:
    row, column = place
    return values[row : row + REGION_BLOCKS, column : column + REGION_BLOCKS].sum(axis=(0, 1))


def _region(place: tuple[int, int], block: int) -> Region:
    top, left = (block * index for index in place)
    side = block * REGION_BLOCKS
    return Region(left, top, left + side, top + side)
