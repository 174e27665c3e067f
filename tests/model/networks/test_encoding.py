import numpy as np
import pytest
import torch

from model.networks.generator_network import decode_unit
from model.scene.inputs import rgb_to_lab
from model.training.batch import encode_batch


def test_known_colours():
    # CIELAB of sRGB red under D65, from the standard's formulas: L 53.24, a 80.09, b 67.20.
    red = rgb_to_lab(np.array([1.0, 0.0, 0.0], np.float32))
    expected = [
        53.24 / 50 - 1,
        2 * (80.09 + 86.185) / 184.439 - 1,
        2 * (67.20 + 107.863) / 202.345 - 1,
    ]
    np.testing.assert_allclose(red, expected, atol=1e-3)
    # Those outside the cube are clipped, not NaN.
    wild = np.array([[-3.0, 0.5, 7.0], [1.001, -1e-9, 0.2]], np.float32)
    np.testing.assert_array_equal(rgb_to_lab(wild), rgb_to_lab(np.clip(wild, 0, 1)))
    assert np.isfinite(rgb_to_lab(wild)).all()


def test_a_batch_keeps_shapes_ranges_and_meaning(store):
    samples = store.read("train", range(6))
    batch = encode_batch(samples, store.scene, 32)
    assert batch.inputs.conditions.shape == (6, 5)
    assert batch.inputs.opacity_tf.shape == (6, 256)
    assert batch.inputs.color_tf.shape == (6, 3, 256)
    assert batch.opacity_image.shape == (6, 1, 32, 32)
    assert batch.image.shape == (6, 3, 64, 64)
    for value in (*batch.inputs, batch.opacity_image, batch.image):
        assert value.dtype == torch.float32
        assert value.abs().max() <= 1 + 1e-6
    blocks = samples.rgba[..., 3].reshape(6, 32, 2, 32, 2).mean(axis=(2, 4)) / 255
    np.testing.assert_allclose(decode_unit(batch.opacity_image)[:, 0].numpy(), blocks, atol=1e-6)
    assert decode_unit(batch.image)[2, 1, 40, 20].item() == pytest.approx(
        samples.rgba[2, 40, 20, 1] / 255, abs=1e-6
    )
