"""Fields of all values: the generator's and the ray caster's, against edits one by one."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from ramp import make_tf, make_volume

from model.generator.generator import Generator
from model.networks.blocks import kaiming_init
from model.networks.card import ModelCard
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import Lighting, Scene
from model.scene.tf_perturbation import (
    edit_around,
    edit_over,
    edits_within,
    response_to_edits,
)
from model.scene.view import View
from model.sensitivity.block_fields import field_of_band, over_pixels, pixels_of_block
from model.sensitivity.display import per_small_edit, scale_of, shown_field, shown_responses
from model.sensitivity.learned import Sensitivity
from model.sensitivity.rendered import block_fields, largest_scales

RANGE = (100.0, 200.0)
WIDTH = 6.0
VIEW = View(40, 20, 3, 1.0)


@pytest.fixture(scope="module")
def generator() -> Generator:
    torch.manual_seed(0)
    size = NetworkSize(0.25, 16, 32)
    network = TwoStageGenerator(size)
    kaiming_init(network)
    card = ModelCard(Scene.of(make_volume(), 32), "draft", size)
    return Generator(card, network, torch.device("cpu"))


@pytest.fixture(scope="module")
def inputs() -> SceneInputs:
    return SceneInputs.of(VIEW, make_tf())


def block_norms(image: np.ndarray, blocks: int) -> np.ndarray:
    """Norm of the colours of each block."""
    side = len(image) // blocks
    parts = image.astype(np.float64).reshape(blocks, side, blocks, side, 3)
    return np.sqrt((parts**2).sum(axis=(1, 3, 4)))


def test_a_block_of_the_paper_networks_changes_as_said(
    generator: Generator, inputs: SceneInputs
) -> None:
    # Central differences in float64 of the norms of 8 x 8 blocks by a smooth edit.
    fields = Sensitivity(generator, inputs, WIDTH).field(4)
    assert fields.shape == (8, 8, 256)
    network = generator.network.double()
    try:
        encoded = generator.encoded([inputs]).map(lambda tensor: tensor.double())
        for value in (120.0, 150.0, 185.0):
            edit = torch.from_numpy(edit_around(value, RANGE, WIDTH).astype(np.float64))
            norms = []
            for step in (1e-5, -1e-5):
                changed = encoded._replace(opacity_tf=encoded.opacity_tf + 2 * step * edit)
                with torch.no_grad():
                    colors = network(changed)[0][0] / 2 + 0.5
                norms.append(block_norms(colors.permute(1, 2, 0).numpy(), 8))
            expected = (norms[0] - norms[1]) / 2e-5
            ours = field_of_band(fields, (value, value), RANGE)
            np.testing.assert_allclose(ours, expected, atol=2e-3 * np.abs(expected).max())
    finally:
        network.float()


def test_a_band_is_the_edit_over_it() -> None:
    rng = np.random.default_rng(0)
    slopes = rng.normal(size=(3, 3, 256)).astype(np.float32)
    fields = response_to_edits(slopes, WIDTH)
    for values in ((150.0, 150.0), (120.0, 140.0), (100.0, 104.0), (90.0, 250.0)):
        expected = slopes.astype(np.float64) @ edit_over(values, RANGE, WIDTH)
        np.testing.assert_allclose(field_of_band(fields, values, RANGE), expected, atol=1e-5)


def test_the_unit_is_the_change_of_a_pixel() -> None:
    # All of a block's numbers rise by .02 per unit of the edit: so does its RMS value.
    image = np.full((8, 8, 3), 0.5)
    rise = block_norms(image + 0.02, 2) - block_norms(image, 2)
    edit = edit_around(0.5, (0.0, 1.0), WIDTH)
    shown = shown_responses(rise, pixels_of_block(8, 2), WIDTH)
    np.testing.assert_allclose(shown, 0.02 * per_small_edit(edit), rtol=1e-5)


def test_blocks_are_spread_over_their_pixels() -> None:
    field = np.array([[1.0, 2.0], [3.0, 4.0]])
    spread = over_pixels(field, 4)
    np.testing.assert_array_equal(spread[[0, 1, 0, 2, 3], [0, 1, 2, 1, 3]], [1, 1, 2, 3, 4])
    assert over_pixels(field, 5).shape == (5, 5)


def test_the_learned_scale_ends_at_the_strongest_of_all_values(
    generator: Generator, inputs: SceneInputs
) -> None:
    found = Sensitivity(generator, inputs, WIDTH)
    ours = found.largest_scales(edits_within(RANGE, RANGE, WIDTH))
    for end, measure in zip(ours, ("change", "signed"), strict=True):
        ends = []
        for place in range(0, 256, 8):
            edit = edit_around(100 + 100 * place / 255, RANGE, WIDTH)
            ends.append(scale_of(shown_field(found.change(edit), edit, measure)))
        assert end == pytest.approx(max(ends), rel=0.03)
        assert end >= max(ends) * 0.999


@pytest.mark.parametrize("lighting", ["none", "soft"])
def test_the_ray_casters_fields_and_scale(inputs: SceneInputs, lighting: Lighting) -> None:
    renderer = RaycastRenderer(make_volume(), lighting, threads=1, sample_distance=1.0)
    fields = block_fields(renderer, inputs, 16, 4, WIDTH)
    edit = edit_around(150.0, RANGE, WIDTH).astype(np.float64)
    change = renderer.change(inputs, 16, edit.astype(np.float32))
    image = renderer.render(inputs, 16)[..., :3].astype(np.float64)
    # The norm's derivative is the change along the image.
    h = 1e-4
    expected = (block_norms(image + h * change, 4) - block_norms(image - h * change, 4)) / (2 * h)
    ours = field_of_band(fields, (150.0, 150.0), RANGE)
    np.testing.assert_allclose(ours, expected, atol=2e-2 * np.abs(expected).max())
    calls = []
    edits = edits_within((130.0, 170.0), RANGE, WIDTH)
    ends = largest_scales(renderer, inputs, 16, edits, lambda: calls.append(1))
    assert len(calls) == len(edits)
    for end, measure in zip(ends, ("change", "signed"), strict=True):
        assert end >= 0.98 * scale_of(shown_field(change, edit, measure))
    renderer.close()


def test_edits_within_an_interval_are_around_its_values() -> None:
    edits = edits_within((130.0, 170.0), RANGE, WIDTH)
    peaks = 100 + 100 * edits.argmax(axis=1) / 255
    assert peaks.min() == pytest.approx(130, abs=2) and peaks.max() == pytest.approx(170, abs=2)
    np.testing.assert_allclose(edits.sum(axis=1), 1, rtol=1e-3)
    # Close enough for none between them to be missed.
    assert np.diff(peaks).max() < WIDTH * 100 / 255
    assert len(edits_within((150.1, 150.1), RANGE, WIDTH)) == 1
