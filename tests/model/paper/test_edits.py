from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from model.paper.edits import (
    AMPLITUDE,
    MOST_OPACITY,
    PAPER_R,
    REGION_BLOCKS,
    region_edits,
    suggested_mode,
    two_regions,
    value_edits,
    with_mode,
)
from model.scene.tf_perturbation import edit_around, with_opacity
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.sensitivity.display import per_small_edit
from model.sensitivity.what_if import compare


def test_a_mode_is_suggested_where_most_is_promised_and_room_is_left(subject, inputs):
    scene = subject.generator.scene
    lo, hi = scene.scalar_range
    values = np.linspace(lo, hi, 256)
    bare = replace(inputs, opacity_tf=OpacityTF(scene.scalar_range))
    responses = np.zeros(256)
    # A strong place outside the window, one that is opaque already, and a weaker negative one.
    responses[[0, 120, 160]] = 9.0, 5.0, -2.0
    opaque = GaussianMode(float(values[120]), 0.02 * (hi - lo), 1.0)
    taken = replace(inputs, opacity_tf=OpacityTF(scene.scalar_range, (opaque,)))
    assert suggested_mode(scene, bare, responses).mean == pytest.approx(values[120])
    found = suggested_mode(scene, taken, responses)
    assert found.mean == pytest.approx(values[160])
    assert taken.opacity_tf(found.mean) < MOST_OPACITY
    again = suggested_mode(scene, bare, responses, GaussianMode(values[120], found.width, 0.1))
    assert again.mean == pytest.approx(values[160])
    assert found.amplitude == AMPLITUDE


@pytest.mark.parametrize("as_curve", [False, True])
def test_a_mode_is_added_to_modes_and_to_curves(subject, inputs, as_curve):
    scene = subject.generator.scene
    lo, hi = scene.scalar_range
    tf = OpacityTF(scene.scalar_range, (GaussianMode(lo + 0.3 * (hi - lo), 0.1 * (hi - lo), 0.4),))
    values = np.linspace(lo, hi, 256)
    before = tf.sample()
    if as_curve:
        points = tuple(zip(values.tolist(), before.tolist(), strict=True))
        tf = OpacityTF(scene.scalar_range, points=points)
    mode = GaussianMode(lo + 0.6 * (hi - lo), 0.05 * (hi - lo), 0.3)
    after = with_mode(replace(inputs, opacity_tf=tf), mode).opacity_tf.sample()
    bump = 0.3 * np.exp(-(((values - mode.mean) / mode.width) ** 2))
    np.testing.assert_allclose(after, before + bump, atol=1e-4)


def test_regions_are_bright_and_react_otherwise():
    image = np.zeros((64, 64, 3), dtype=np.float32)
    image[8:24, 8:24] = 1.0
    image[40:56, 8:24] = 0.8
    image[40:56, 40:56] = 0.8
    fields = np.zeros((16, 16, 256), dtype=np.float32)
    fields[2:6, 2:6, 50] = fields[10:14, 2:6, 50] = 1.0
    fields[10:14, 10:14, 200] = 1.0
    first, second = two_regions(image, fields)
    assert (first.left, first.top, first.right, first.bottom) == (8, 8, 24, 24)
    # Of the two that are as bright, the one that reacts at other values.
    assert second.left >= 32 and second.top >= 32
    assert second.right - second.left == 4 * REGION_BLOCKS


def test_each_row_goes_on_from_the_edit_before(subject, inputs):
    steps = region_edits(subject, inputs)
    assert [step.region is None for step in steps] == [False, False, True]
    for before, after in pairwise(steps):
        assert before.mode is not None and before.region is not None
        assert after.inputs == with_mode(before.inputs, before.mode)
        mask = before.region.mask(subject.size)
        np.testing.assert_allclose(after.drawn, subject.drawn(after.inputs), atol=1e-6)
        assert before.changes[0] == pytest.approx(compare(before.drawn, after.drawn, mask).rmse)
        assert before.changes[1] == pytest.approx(compare(before.truth, after.truth, mask).rmse)


def test_responses_of_a_region_are_those_of_small_edits(subject, inputs):
    """Against the network itself, by images of slightly more opacity at one value."""
    scene = subject.generator.scene
    opacity = np.clip(inputs.opacity_tf.sample(scene.scalar_range), 0.1, 0.9)
    # So that there is room for less opacity, too.
    inputs = with_opacity(inputs, opacity)
    (step, *_) = region_edits(subject, inputs)
    assert step.region is not None and step.responses is not None
    mask = step.region.mask(subject.size)
    index = 128
    values = np.linspace(*scene.scalar_range, 256)
    edit = edit_around(values[index], scene.scalar_range, 6.0)
    height = 1e-3 * per_small_edit(edit) / 0.01
    norms = []
    for sign in (-1, 1):
        image = subject.drawn(with_opacity(inputs, opacity + sign * height * edit))
        norms.append(np.linalg.norm(image[mask].astype(np.float64)))
    slope = (norms[1] - norms[0]) / (2 * 1e-3) * 0.01 / np.sqrt(3 * mask.sum())
    assert step.responses[index] == pytest.approx(slope, rel=0.1, abs=1e-5)


def test_a_value_field_has_the_papers_blocks(subject, inputs):
    steps = value_edits(subject, inputs)
    assert [step.field is None for step in steps] == [False, False, True]
    field = steps[0].field
    assert field is not None and steps[0].mode is not None
    assert field.value == steps[0].mode.mean
    values = np.linspace(*subject.generator.scene.scalar_range, 256)
    assert values[field.band.argmax()] == pytest.approx(field.value)
    assert field.band.max() == 1
    side = subject.size // PAPER_R
    # The image behind has a finer grain than the blocks; what is opaque has theirs.
    assert field.blocks.shape == field.pixels.shape == (64, 64, 3)
    assert 0 < field.scale <= field.whole * 1.0001
    assert side == 4
