"""The generator's sensitivity, against central differences of the network in float64."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from model.errors import RenderError
from model.generator.generator import Generator
from model.networks.blocks import kaiming_init
from model.networks.card import ModelCard
from model.networks.generator_network import decode_unit
from model.networks.paper import TwoStageGenerator
from model.networks.size import NetworkSize
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.sensitivity.agreement import sensitivity_agreement
from model.sensitivity.exact import region_sensitivity, sensitivity_field
from model.sensitivity.learned import Sensitivity

VIEW = View(40, 20, 3, 0.8)
SIZE = NetworkSize(0.25, 16, 32, modulation=True)


@pytest.fixture(scope="module")
def tf(scene):
    lo, hi = scene.scalar_range
    opacity = OpacityTF((lo, hi), (GaussianMode((lo + hi) / 2, (hi - lo) / 9, 0.6),))
    return TransferFunction(opacity, ColorTF((lo, hi), ((lo, 0.1, 0.2, 0.9), (hi, 1, 0.6, 0.1))))


@pytest.fixture(scope="module")
def generator(scene):
    torch.manual_seed(0)
    network = TwoStageGenerator(SIZE)
    kaiming_init(network)
    # Batch statistics as after training: none of the layers is the identity.
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm1d | torch.nn.BatchNorm2d):
            torch.nn.init.normal_(module.running_mean, std=0.1)
            torch.nn.init.uniform_(module.running_var, 0.5, 2.0)
    card = ModelCard(replace(scene, image_size=32), "draft", SIZE, {}, {}, {})
    return Generator(card, network, torch.device("cpu"))


@pytest.fixture(scope="module")
def sensitivity(generator, tf):
    return Sensitivity(generator, SceneInputs.of(VIEW, tf), edit_width=0)


def image(generator, tf, change):
    """Colours in float64, with the opacities changed."""
    network = generator.network.double()
    try:
        inputs = generator.encoded([SceneInputs.of(VIEW, tf)]).map(lambda tensor: tensor.double())
        opacity = inputs.opacity_tf + 2 * torch.from_numpy(change)
        with torch.no_grad():
            out = network(inputs._replace(opacity_tf=opacity))[0][0]
        return (out / 2 + 0.5).permute(1, 2, 0).numpy()
    finally:
        network.float()


def test_the_image_is_the_generators(generator, sensitivity, tf):
    rgba = generator.render(SceneInputs.of(VIEW, tf))
    np.testing.assert_allclose(sensitivity.image, rgba[..., :3], atol=1e-5)
    assert decode_unit(torch.tensor(-1.0)) == 0


@pytest.mark.parametrize("region", [Region(0, 0, 32, 32), Region(5, 9, 21, 14)])
def test_a_regions_sensitivity_is_the_derivative_of_its_norm(generator, sensitivity, tf, region):
    ours, h = sensitivity.region(region), 1e-5
    part = np.s_[region.top : region.bottom, region.left : region.right]
    rng = np.random.default_rng(0)
    for _ in range(4):
        direction = rng.normal(size=256)
        images = [image(generator, tf, step * direction) for step in (h, -h)]
        expected = np.subtract(*(np.linalg.norm(each[part]) for each in images)) / (2 * h)
        scale = float(np.linalg.norm(ours))
        assert ours @ direction == pytest.approx(expected, abs=2e-3 * scale)


@pytest.mark.parametrize("block", [1, 5, 8, 32])
def test_the_field_holds_the_sensitivity_of_each_block(sensitivity, block):
    field = sensitivity.field(block)
    blocks = -(-32 // block)
    assert field.shape == (blocks, blocks, 256)
    row, column = blocks - 1, blocks // 2
    left, top = column * block, row * block
    region = Region(left, top, min(left + block, 32), min(top + block, 32))
    scale = np.abs(field).max()
    np.testing.assert_allclose(field[row, column], sensitivity.region(region), atol=1e-6 * scale)


def test_a_black_region_has_no_sensitivity(generator, tf, monkeypatch):
    decode = generator.network.decode

    def half_black(*features):
        image, opacity = decode(*features)
        black = torch.arange(32) < 16
        return torch.where(black, -1.0, image), opacity

    monkeypatch.setattr(generator.network, "decode", half_black)
    ours = Sensitivity(generator, SceneInputs.of(VIEW, tf))
    assert not ours.region(Region(0, 0, 4, 4)).any()
    for block in (1, 8):
        field = ours.field(block)
        assert np.isfinite(field).all()
        assert not field[:, : 16 // block].any()
        assert field[:, 16 // block :].any()


def test_a_change_is_the_derivative_of_the_image(generator, sensitivity, tf):
    edit = np.random.default_rng(0).normal(size=256)
    h = 1e-5
    expected = (image(generator, tf, h * edit) - image(generator, tf, -h * edit)) / (2 * h)
    # The first is one pass, the second asks for all directions, the third is made of these.
    for _ in range(3):
        ours = sensitivity.change(edit.astype(np.float32))
        np.testing.assert_allclose(ours, expected, atol=1e-3 * np.abs(expected).max())


def test_regions_outside_are_refused(sensitivity):
    with pytest.raises(RenderError, match="outside"):
        sensitivity.region(Region(0, 0, 33, 4))
    with pytest.raises(RenderError, match="do not fit"):
        sensitivity.field(0)


SMALL = NetworkSize(0.125, 16, 32)


@pytest.mark.parametrize(("factor", "expected"), [(2.0, 1.0), (-1.0, -1.0)])
def test_the_renderers_own_sensitivity_agrees_with_itself(
    volume, scene, monkeypatch, factor, expected
):
    class Own:
        """In the place of the generator's sensitivity, the renderer's times a factor."""

        def __init__(self, _generator, inputs, edit_width):
            assert edit_width == 0
            self.arguments = (RaycastRenderer(volume), inputs, 32)

        def region(self, region):
            return factor * region_sensitivity(*self.arguments, region)

        def field(self, block):
            return factor * sensitivity_field(*self.arguments, block)

    monkeypatch.setattr("model.sensitivity.agreement.Sensitivity", Own)
    scene = replace(scene, image_size=32)
    samples = [draw_sample(scene, 0, "holdout", i) for i in range(3)]
    card = ModelCard(scene, "draft", SMALL, {}, {}, {})
    generator = Generator(card, TwoStageGenerator(SMALL), torch.device("cpu"))
    agreement = sensitivity_agreement(generator, volume, samples)
    for values in vars(agreement).values():
        np.testing.assert_allclose(values, expected, rtol=1e-5)
