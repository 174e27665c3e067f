"""A codec of one Gaussian mode, whose two numbers are its mean and its height."""

import numpy as np

from model.latent.codes import TFCodec
from model.latent.latent_space import UNIT_SCENE, LatentSpace, TFFrame

BINS = np.arange(256)
WIDTH = 20.0


class ToyCodec(TFCodec):
    """Decodes (mean, height) in [-1, 1] to a mode, and encodes a TF by its peak."""

    def __init__(self):
        pass

    def encode(self, opacities):
        means = opacities.argmax(axis=1) / 255 * 2 - 1
        heights = opacities.max(axis=1) * 2 - 1
        return np.stack([means, heights], axis=1).astype(np.float32)

    def decode(self, codes):
        means, heights = (codes.astype(np.float64).T[:, :, None] + 1) / 2
        shapes = np.exp(-(((BINS - 255 * means) / WIDTH) ** 2))
        return (heights.clip(0, 1) * shapes).astype(np.float32)


class ToySpace(LatentSpace):
    """A space with few samples."""

    def open_map(self, count=150):
        return super().open_map(count)


def toy_space(folder, scalar_range, window, scale="linear"):
    return ToySpace(ToyCodec(), TFFrame(scalar_range, window, scale), UNIT_SCENE, "toy", (folder,))
