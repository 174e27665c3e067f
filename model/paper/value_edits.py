"""Scalar value sensitivity fields that drive two edits (paper, section 6.1 and Fig. 9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.paper.edits import suggested_mode, with_mode
from model.paper.subject import Image, Subject
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.tf_perturbation import EDIT_WIDTH, edit_around
from model.scene.transfer_function import GaussianMode
from model.sensitivity.display import (
    field_of_value,
    global_scale,
    overlay_globally,
    scale_of,
    shown_field,
    shown_responses,
    spread_blocks,
)
from model.sensitivity.learned import Sensitivity

PAPER_R = 16
"""The paper's grid resolution r: blocks along each side of a field; it sets 8 or 16."""


@dataclass(frozen=True, eq=False)
class ValueField:
    """The field of one scalar value, as the paper shows it and with every pixel.

    Attributes
    ----------
    band : ndarray of float64, shape (256,)
        The Gaussian by which fields of neighbouring values count, at most 1.
    responses : ndarray of float64, shape (256,)
        Sensitivity of the whole image, in the displayed unit.
    blocks, pixels : ndarray of float64, shape (S, S, 3)
        The field in r x r blocks, and for each pixel, coloured over the dim image.
    scale, whole : float
        Ends of the scales of opacity and of colour, in the displayed unit.
    """

    value: float
    band: NDArray[np.float64]
    responses: NDArray[np.float64]
    blocks: NDArray[np.float64]
    pixels: NDArray[np.float64]
    scale: float
    whole: float


@dataclass(frozen=True, eq=False)
class ValueStep:
    """One row of the figure; the last has no field, and shows what the second edit did."""

    inputs: SceneInputs
    drawn: Image
    truth: Image
    field: ValueField | None = None
    mode: GaussianMode | None = None


def value_edits(subject: Subject, inputs: SceneInputs) -> list[ValueStep]:
    """Look at the fields of two values, and add a mode at each."""
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
    return shown_responses(found, size**2, EDIT_WIDTH)


def value_field(subject: Subject, inputs: SceneInputs, value: float) -> ValueField:
    """Compute the field of a scalar value, with the paper's colours: by all values' fields."""
    size, scalar_range = subject.size, subject.generator.scene.scalar_range
    block = size // PAPER_R
    found = Sensitivity(subject.generator, inputs)
    image = found.image
    fields = found.field(block)
    whole = global_scale(fields, block**2, EDIT_WIDTH)
    of_blocks = shown_responses(
        field_of_value(fields, value, scalar_range), block**2, EDIT_WIDTH
    ).astype(np.float32)
    edit = edit_around(value, scalar_range, EDIT_WIDTH)
    of_pixels = shown_field(found.change(edit), edit, "change")
    scale = scale_of(of_blocks)
    return ValueField(
        value=value,
        band=np.asarray(edit / edit.max(), dtype=np.float64),
        responses=whole_responses(subject, inputs),
        blocks=overlay_globally(image, spread_blocks(of_blocks, size, block), scale, whole),
        pixels=overlay_globally(image, of_pixels, scale_of(of_pixels), whole),
        scale=scale,
        whole=whole,
    )
