"""Encoding of scene inputs and images for the networks, with all values in [-1, 1].

Scene inputs are encoded by :mod:`model.scene.inputs`; opacities and image values are
scaled linearly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from model.scene.color_space import LAB_HIGH, LAB_LOW, WHITE, XYZ_TO_RGB
from model.scene.inputs import Arrays, SceneInputs, encode_inputs, store_inputs
from model.scene.scene import Scene


class EncodedInputs(NamedTuple):
    """Scene inputs of N images as network inputs, in [-1, 1].

    Attributes
    ----------
    conditions : Tensor, shape (N, C)
        The five view parameters (:meth:`model.scene.view.View.vector`), then those of
        the scene's other inputs, such as a movable light.
    opacity_tf : Tensor, shape (N, 256)
    color_tf : Tensor, shape (N, 3, 256)
        In scaled CIELAB.
    """

    conditions: Tensor
    opacity_tf: Tensor
    color_tf: Tensor

    @classmethod
    def of(cls, inputs: Sequence[SceneInputs], scene: Scene) -> EncodedInputs:
        """Encode the inputs of a scene's images."""
        return cls.stored(store_inputs(inputs, scene), scene)

    @classmethod
    def stored(cls, arrays: Arrays, scene: Scene) -> EncodedInputs:
        """Encode inputs given in the stored form of samples."""
        return cls(**{k: torch.from_numpy(v) for k, v in encode_inputs(arrays, scene).items()})

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


def decode_colors(color_tf: Tensor) -> Tensor:
    """Convert colour TFs in scaled CIELAB (N, 3, 256) to sRGB (N, 3, 256) in [0, 1].

    The differentiable inverse of :func:`encode_colors`.
    """
    low, high = (color_tf.new_tensor(bound)[:, None] for bound in (LAB_LOW, LAB_HIGH))
    lightness, a, b = (low + (color_tf + 1) / 2 * (high - low)).unbind(1)
    y = (lightness + 16) / 116
    roots = torch.stack([y + a / 500, y, y - b / 200], dim=1)
    # CIE's definition of CIELAB, with its linear segment near black.
    straight = (roots - 4 / 29) * 3 * (6 / 29) ** 2
    xyz = torch.where(roots > 6 / 29, roots**3, straight) * roots.new_tensor(WHITE)[:, None]
    linear = torch.einsum("rx,nxb->nrb", xyz.new_tensor(XYZ_TO_RGB), xyz).clamp(0, 1)
    # sRGB's transfer curve; its root is not differentiable at 0.
    curved = 1.055 * linear.clamp_min(1e-6) ** (1 / 2.4) - 0.055
    return torch.where(linear > 0.0031308, curved, 12.92 * linear)
