import numpy as np
import pytest
import torch

from model.rendering.raster import resized


@pytest.mark.parametrize("shape", [(7, 9), (20, 31), (5, 40)])
def test_pixels_between_are_interpolated_as_torch_does(shape):
    image = np.random.default_rng(0).random((5, 9, 4)).astype(np.float32)
    planes = torch.from_numpy(image).permute(2, 0, 1)[None]
    theirs = torch.nn.functional.interpolate(planes, shape, mode="bilinear")
    found = resized(image, shape)
    np.testing.assert_allclose(found, theirs[0].permute(1, 2, 0).numpy(), atol=1e-6)
