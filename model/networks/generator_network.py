"""The interface of networks that generate images: inputs, in [-1, 1], and codec."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from model.networks.blocks import LEAK, TFEncoder, mlp
from model.networks.size import NetworkSize
from model.scene.inputs import Arrays, SceneInputs, encode_inputs, store_inputs
from model.scene.scene import Scene
from model.scene.transfer_function import TF_SAMPLES


class EncodedInputs(NamedTuple):
    """Scene inputs of N images as network inputs, in [-1, 1]."""

    conditions: Tensor  # (N, C): five view parameters, then those of other inputs (light)
    opacity_tf: Tensor  # shape (N, 256)
    color_tf: Tensor  # (N, 3, 256) in scaled CIELAB

    @classmethod
    def of(cls, inputs: Sequence[SceneInputs], scene: Scene) -> EncodedInputs:
        """Encode the inputs of a scene's images."""
        return cls.stored(store_inputs(inputs, scene), scene)

    @classmethod
    def stored(cls, arrays: Arrays, scene: Scene) -> EncodedInputs:
        """Encode inputs given in the stored form of samples."""
        return cls.encoded(encode_inputs(arrays, scene))

    @classmethod
    def encoded(cls, arrays: Arrays) -> EncodedInputs:
        """Return inputs that :func:`model.scene.inputs.encode_inputs` has encoded."""
        return cls(**{name: torch.from_numpy(array) for name, array in arrays.items()})

    def map(self, function: Callable[[Tensor], Tensor]) -> EncodedInputs:
        """Apply a function to each tensor."""
        return EncodedInputs(*map(function, self))


def encode_unit(values: NDArray[np.float32]) -> Tensor:
    """Scale values of any shape from [0, 1] to [-1, 1]."""
    return torch.from_numpy(np.ascontiguousarray(values)) * 2 - 1


def decode_unit(values: Tensor) -> Tensor:
    """Scale values of any shape from [-1, 1] to [0, 1]."""
    # At least float32 precision; float64 is kept for checks of derivatives.
    return values.to(torch.promote_types(values.dtype, torch.float32)) / 2 + 0.5


class LatentCodec(nn.Module):
    """Encoder of opacity TFs into latent codes, and decoder of codes into opacity TFs."""

    def __init__(self, size: NetworkSize) -> None:
        super().__init__()
        c = size.channels
        hidden = [c(512), c(512)] if size.deep_codec else [c(128)]
        self.encoder = nn.Sequential(
            TFEncoder([1, c(16), c(32), c(64), c(128), c(128)], c(256)),
            nn.Linear(c(256), size.latent_dim),
            nn.LeakyReLU(LEAK),
        )
        self.tf_decoder = nn.Sequential(
            mlp(size.latent_dim, *hidden), nn.Linear(hidden[-1], TF_SAMPLES), nn.Tanh()
        )

    def encode(self, opacity_tf: Tensor) -> Tensor:
        """Encode opacity TFs (N, 256) in [-1, 1] as latent codes (N, latent_dim)."""
        z: Tensor = self.encoder(opacity_tf[:, None])
        return z

    def decode(self, latent: Tensor) -> Tensor:
        """Decode latent codes (N, latent_dim) into opacity TFs (N, 256) in [-1, 1]."""
        tf: Tensor = self.tf_decoder(latent)
        return tf


class GeneratorNetwork(nn.Module, ABC):
    """A differentiable function of view and transfer functions.

    :meth:`features` prepares the input of :meth:`decode`, the larger part, which inference
    libraries can replace. Images depend on the opacity TF only through its latent code.
    """

    def forward(self, inputs: EncodedInputs) -> tuple[Tensor, Tensor]:
        """Generate colour and opacity images from scene inputs."""
        return self.decode(*self.features(inputs))

    @property
    @abstractmethod
    def codec(self) -> LatentCodec:
        """Encoder and decoder of opacity TFs."""

    @abstractmethod
    def features(self, inputs: EncodedInputs) -> tuple[Tensor, ...]:
        """Tensors of N rows that :meth:`decode` takes, from scene inputs."""

    @abstractmethod
    def latent_features(
        self, conditions: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, ...]:
        """Return :meth:`features` from latent codes (N, latent_dim) instead of opacity TFs."""

    @abstractmethod
    def decode(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        """Colour and opacity images, as :meth:`forward` returns them."""
