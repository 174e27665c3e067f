"""Fields of all values: the generator's and the ray caster's, against edits one by one."""

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
from model.scene.scene import Scene
from model.scene.tf_perturbation import edit_around
from model.scene.view import View
from model.sensitivity.display import per_small_edit, shown_responses
from model.sensitivity.learned import Sensitivity
from model.sensitivity.rendered import block_fields

RANGE = (100.0, 200.0)
WIDTH = 6.0
VIEW = View(40, 20, 3, 1.0)


@pytest.fixture(scope="module")
def generator():
    torch.manual_seed(0)
    size = NetworkSize(0.25, 16, 32)
    network = TwoStageGenerator(size)
    kaiming_init(network)
    card = ModelCard(Scene.of(make_volume(), 32), "draft", size)
    return Generator(card, network, torch.device("cpu"))


@pytest.fixture(scope="module")
def inputs():
    return SceneInputs.of(VIEW, make_tf())


def block_norms(image, blocks):
    """Norm of the colours of each block."""
    side = len(image) // blocks
    parts = image.astype(np.float64).reshape(blocks, side, blocks, side, 3)
    return np.sqrt((parts**2).sum(axis=(1, 3, 4)))


def test_a_block_of_the_paper_networks_changes_as_said(generator, inputs):
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
            ours = fields[..., round(255 * (value - 100) / 100)]
            np.testing.assert_allclose(ours, expected, atol=2e-3 * np.abs(expected).max())
    finally:
        network.float()


def test_the_unit_is_the_change_of_a_pixel():
    # All of a block's numbers rise by .02 per unit of the edit: so does its RMS value.
    image = np.full((8, 8, 3), 0.5)
    rise = block_norms(image + 0.02, 2) - block_norms(image, 2)
    edit = edit_around(0.5, (0.0, 1.0), WIDTH)
    shown = shown_responses(rise, 4 * 4, WIDTH)
    np.testing.assert_allclose(shown, 0.02 * per_small_edit(edit), rtol=1e-5)


@pytest.mark.parametrize("lighting", ["none", "soft"])
def test_the_ray_casters_fields(inputs, lighting):
    renderer = RaycastRenderer(make_volume(), lighting, threads=1, sample_distance=1.0)
    fields = block_fields(renderer, inputs, 16, 4, WIDTH)
    edit = edit_around(150.0, RANGE, WIDTH).astype(np.float64)
    change = renderer.change(inputs, 16, edit.astype(np.float32))
    image = renderer.render(inputs, 16)[..., :3].astype(np.float64)
    # The norm's derivative is the change along the image.
    h = 1e-4
    expected = (block_norms(image + h * change, 4) - block_norms(image - h * change, 4)) / (2 * h)
    ours = fields[..., round(255 * 0.5)]
    np.testing.assert_allclose(ours, expected, atol=2e-2 * np.abs(expected).max())
    renderer.close()
