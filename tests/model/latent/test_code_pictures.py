"""Pictures of codes against the network run by hand, on codes and on decoded TFs."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from model.errors import LatentError
from model.latent.latent_space import LatentSpace, draw_codes
from model.networks.generator_network import EncodedInputs, decode_unit
from model.networks.paper import TwoStageGenerator
from model.samples.sampling import draw_sample


@pytest.fixture(scope="module")
def space(lively_folder):
    return LatentSpace.of_model(lively_folder)


@pytest.fixture(scope="module")
def codes(space):
    tfs = np.random.default_rng(1).uniform(0, 1, (5, 256)).astype(np.float32)
    return space.codec.encode(np.cumsum(tfs, axis=1) / 256)


def test_a_code_is_drawn_as_it_is(lively_generator, space, codes, scene):
    inputs = draw_sample(scene, 3, "train", 0)
    network = lively_generator.network
    assert isinstance(network, TwoStageGenerator)
    with torch.inference_mode():
        encoded = EncodedInputs.of([inputs], scene)
        view = network.opacity.encode_view(encoded.conditions)
        for code, image in zip(
            codes, draw_codes(lively_generator, space, codes, inputs), strict=True
        ):
            latent = torch.from_numpy(code)[None]
            opacity = network.opacity.decode_image(view, latent)
            color = network.translation(encoded.conditions, latent, encoded.color_tf, opacity)
            expected = decode_unit(color)[0].permute(1, 2, 0).numpy()
            np.testing.assert_allclose(image[..., :3], expected, atol=1e-5)


def test_the_tf_of_a_code_is_drawn_as_whoever_takes_it_sees_it(
    lively_generator, space, codes, scene
):
    inputs = draw_sample(scene, 3, "train", 0)
    drawn = draw_codes(lively_generator, space, codes, inputs, "tf")
    for code, image in zip(codes, drawn, strict=True):
        taken = lively_generator.render(replace(inputs, opacity_tf=space.tf_of(code)))
        np.testing.assert_allclose(image, taken, atol=1e-5)
    assert np.abs(drawn - draw_codes(lively_generator, space, codes, inputs)).max() > 0.01


def test_codes_that_cannot_be_drawn_are_refused(lively_generator, space, codes, scene):
    inputs = draw_sample(scene, 3, "train", 0)
    with pytest.raises(LatentError, match="8 numbers, not 7"):
        draw_codes(lively_generator, space, codes[:, :7], inputs)
    with pytest.raises(LatentError, match="finite"):
        draw_codes(lively_generator, space, codes * np.nan, inputs)
