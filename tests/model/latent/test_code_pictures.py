"""Pictures of codes against the network run by hand, on codes and on decoded TFs."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from lively import SIZE, lively_network

from model.errors import LatentError
from model.generator.generator import Generator
from model.latent.latent_space import LatentSpace, draw_codes
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.networks.generator_network import EncodedInputs, decode_unit
from model.networks.paper import TwoStageGenerator
from model.samples.sampling import draw_sample


@pytest.fixture(scope="module")
def folder(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    save_model(folder, ModelCard(scene, "draft", SIZE), lively_network())
    return folder


@pytest.fixture(scope="module")
def generator(folder):
    return Generator.load(folder, "cpu")


@pytest.fixture(scope="module")
def space(folder):
    return LatentSpace.of_model(folder)


@pytest.fixture(scope="module")
def codes(space):
    tfs = np.random.default_rng(1).uniform(0, 1, (5, 256)).astype(np.float32)
    return space.codec.encode(np.cumsum(tfs, axis=1) / 256)


def test_a_code_is_drawn_as_it_is(generator, space, codes, scene):
    inputs = draw_sample(scene, 3, "train", 0)
    network = generator.network
    assert isinstance(network, TwoStageGenerator)
    with torch.inference_mode():
        encoded = EncodedInputs.of([inputs], scene)
        view = network.opacity.encode_view(encoded.conditions)
        for code, image in zip(codes, draw_codes(generator, space, codes, inputs), strict=True):
            latent = torch.from_numpy(code)[None]
            opacity = network.opacity.decode_image(view, latent)
            color = network.translation(encoded.conditions, latent, encoded.color_tf, opacity)
            expected = decode_unit(color)[0].permute(1, 2, 0).numpy()
            np.testing.assert_allclose(image[..., :3], expected, atol=1e-5)


def test_the_tf_of_a_code_is_drawn_as_whoever_takes_it_sees_it(generator, space, codes, scene):
    inputs = draw_sample(scene, 3, "train", 0)
    drawn = draw_codes(generator, space, codes, inputs, "tf")
    for code, image in zip(codes, drawn, strict=True):
        taken = generator.render(replace(inputs, opacity_tf=space.tf_of(code)))
        np.testing.assert_allclose(image, taken, atol=1e-5)
    assert np.abs(drawn - draw_codes(generator, space, codes, inputs)).max() > 0.01


def test_codes_that_cannot_be_drawn_are_refused(generator, space, codes, scene):
    inputs = draw_sample(scene, 3, "train", 0)
    with pytest.raises(LatentError, match="8 numbers, not 7"):
        draw_codes(generator, space, codes[:, :7], inputs)
    with pytest.raises(LatentError, match="finite"):
        draw_codes(generator, space, codes * np.nan, inputs)
