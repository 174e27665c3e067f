"""Edits of an opacity TF suggested by sensitivities, and their effects (paper, Figs. 8, 9)."""

import math
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from model.paper.subject import Image, Subject
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Scene
from model.scene.tf_emphasis import add_mode
from model.scene.tf_perturbation import EDIT_WIDTH, edit_around
from model.scene.transfer_function import TF_SAMPLES, GaussianMode
from model.sensitivity import display
from model.sensitivity.learned import Sensitivity
from model.sensitivity.what_if import compare

AMPLITUDE = 0.3  # opacity of a mode that is added
MOST_OPACITY = 0.6  # opacity from which one more mode would hardly be visible


def suggested_mode(
    scene: Scene,
    inputs: SceneInputs,
    responses: NDArray[np.floating],
    not_near: GaussianMode | None = None,
) -> GaussianMode:
    """Return the most promising mode, as the paper's user reads it off the plot."""
    lo, hi = scene.scalar_range
    values = np.linspace(lo, hi, TF_SAMPLES)
    # A mode has no 1/2 in its exponent.
    width = math.sqrt(2) * EDIT_WIDTH * (hi - lo) / (TF_SAMPLES - 1)
    opacity = inputs.opacity_tf.sample(scene.scalar_range)
    first, last = scene.scalar_window
    free = (values >= first) & (values <= last) & (opacity < MOST_OPACITY)
    if not_near is not None:
        free &= np.abs(values - not_near.mean) > 2 * not_near.width
    strength = np.where(free, np.abs(responses), -1.0)
    return GaussianMode(float(values[strength.argmax()]), width, AMPLITUDE)


def with_mode(inputs: SceneInputs, mode: GaussianMode) -> SceneInputs:
    """Return the inputs with one more mode of the opacity TF, of modes or a free curve."""
    width = mode.width / math.sqrt(2)
    tf = add_mode(inputs.opacity_tf, mode.mean, width, mode.amplitude)
    return replace(inputs, opacity_tf=tf)


BLOCKS = 16  # blocks along each side by which regions are chosen
REGION_BLOCKS = 4  # blocks along each side of a region
LEAST_BRIGHTNESS = 0.35  # least brightness of the second region, relative to the first


@dataclass(frozen=True, eq=False)
class RegionStep:
    """One row of Fig. 8; the last has no region, and shows the second edit's effect."""

    inputs: SceneInputs
    drawn: Image  # the model's
    truth: Image
    region: Region | None = None
    responses: NDArray[np.float64] | None = None  # the region's (256,), in the displayed unit
    mode: GaussianMode | None = None  # the mode to be added
    changes: tuple[float, float] | None = None  # RMS change of the region: the model's, the true


def region_edits(subject: Subject, inputs: SceneInputs) -> list[RegionStep]:
    """Select two regions that react differently, and add the mode that each one's plot suggests."""
    found = Sensitivity(subject.generator, inputs)
    regions = two_regions(found.image, found.field(subject.size // BLOCKS))
    steps, mode = [], None
    for region in regions:
        sensitivity = Sensitivity(subject.generator, inputs)
        mask = region.mask(subject.size)
        responses = display.shown_responses(sensitivity.region(region), int(mask.sum()), EDIT_WIDTH)
        mode = suggested_mode(subject.generator.scene, inputs, responses, mode)
        edited = with_mode(inputs, mode)
        drawn, truth = subject.drawn(inputs), subject.truth(inputs)
        changes = (
            compare(drawn, subject.drawn(edited), mask).rmse,
            compare(truth, subject.truth(edited), mask).rmse,
        )
        steps.append(RegionStep(inputs, drawn, truth, region, responses, mode, changes))
        inputs = edited
    return [*steps, RegionStep(inputs, subject.drawn(inputs), subject.truth(inputs))]


def two_regions(image: Image, fields: NDArray[np.floating]) -> tuple[Region, Region]:
    """Choose the brightest square of an image, and a separate one that reacts differently."""
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


PAPER_R = 16  # the paper's grid resolution r: blocks along each side of a field; it sets 8 or 16


@dataclass(frozen=True, eq=False)
class ValueField:
    """The field of one scalar value: the paper's, and per pixel."""

    value: float
    band: NDArray[np.float64]  # Gaussian weights (256,) of fields of near values, at most 1
    responses: NDArray[np.float64]  # (256,) of the whole image, in the displayed unit
    blocks: NDArray[np.float64]  # in r x r blocks, coloured over the dim image, (S, S, 3)
    pixels: NDArray[np.float64]  # the same for each pixel
    scale: float  # ends of the scales of opacity and of colour, in the displayed unit
    whole: float


@dataclass(frozen=True, eq=False)
class ValueStep:
    """One row of Fig. 9; the last has no field, and shows the second edit's effect."""

    inputs: SceneInputs
    drawn: Image
    truth: Image
    field: ValueField | None = None
    mode: GaussianMode | None = None


def value_edits(subject: Subject, inputs: SceneInputs) -> list[ValueStep]:
    """Compute the fields of two values, and add a mode at each."""
    steps, mode = [], None
    for _ in range(2):
        responses = whole_responses(subject, inputs)
        mode = suggested_mode(subject.generator.scene, inputs, responses, mode)
        field = value_field(subject, inputs, mode.mean)
        step = ValueStep(inputs, subject.drawn(inputs), subject.truth(inputs), field, mode)
        steps.append(step)
        inputs = with_mode(inputs, mode)
    return [*steps, ValueStep(inputs, subject.drawn(inputs), subject.truth(inputs))]


def whole_responses(subject: Subject, inputs: SceneInputs) -> NDArray[np.float64]:
    """Sensitivity (256,) of the whole image in the displayed unit."""
    size = subject.size
    found = Sensitivity(subject.generator, inputs).region(Region.whole(size))
    return display.shown_responses(found, size**2, EDIT_WIDTH)


def value_field(subject: Subject, inputs: SceneInputs, value: float) -> ValueField:
    """Compute the field of a scalar value, with the paper's colours: by all values' fields."""
    size, scalar_range = subject.size, subject.generator.scene.scalar_range
    block = size // PAPER_R
    found = Sensitivity(subject.generator, inputs)
    image = found.image
    fields = found.field(block)
    whole = display.global_scale(fields, block**2, EDIT_WIDTH)
    of_value = display.field_of_value(fields, value, scalar_range)
    of_blocks = display.shown_responses(of_value, block**2, EDIT_WIDTH).astype(np.float32)
    edit = edit_around(value, scalar_range, EDIT_WIDTH)
    of_pixels = display.shown_field(found.change(edit), edit, "change")
    scale = display.scale_of(of_blocks)
    return ValueField(
        value=value,
        band=np.asarray(edit / edit.max(), dtype=np.float64),
        responses=whole_responses(subject, inputs),
        blocks=display.overlay_globally(
            image, display.spread_blocks(of_blocks, size, block), scale, whole
        ),
        pixels=display.overlay_globally(image, of_pixels, display.scale_of(of_pixels), whole),
        scale=scale,
        whole=whole,
    )
