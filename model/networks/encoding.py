"""Between what people mean and what the networks see: all values in [-1, 1].

What an image depends on is encoded as :mod:`model.scene.inputs` says; opacities and
image values are scaled linearly.
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
    """Scene inputs of N images as the networks see them, in [-1, 1].

    Attributes
    ----------
    conditions : Tensor, shape (N, C)
        The view's five numbers (:meth:`model.scene.view.View.vector`), then those of
        whatever else images of the scene differ in.
    opacity_tf : Tensor, shape (N, 256)
    color_tf : Tensor, shape (N, 3, 256)
        In scaled CIELAB.
    """

    conditions: Tensor
    opacity_tf: Tensor
    color_tf: Tensor

    @classmethod
    def of(cls, inputs: Sequence[SceneInputs], scene: Scene) -> EncodedInputs:
        """Encode inputs of a scene's images."""
        return cls.stored(store_inputs(inputs, scene), scene)

    @classmethod
    def stored(cls, arrays: Arrays, scene: Scene) -> EncodedInputs:
        """Encode inputs as samples store them."""
        return cls(**{k: torch.from_numpy(v) for k, v in encode_inputs(arrays, scene).items()})

    def map(self, function: Callable[[Tensor], Tensor]) -> EncodedInputs:
        """Apply a function to each tensor."""
        return EncodedInputs(*map(function, self))


def encode_unit(values: NDArray[np.float32]) -> Tensor:
    """Scale values of any shape from [0, 1] to [-1, 1]."""
    return torch.from_numpy(np.ascontiguousarray(values)) * 2 - 1


def decode_unit(values: Tensor) -> Tensor:
    """Scale values of any shape from [-1, 1] to [0, 1]."""
    # No fewer digits than float32's, and float64's where derivatives are checked.
    return values.to(torch.promote_types(values.dtype, torch.float32)) / 2 + 0.5


def decode_colors(color_tf: Tensor) -> Tensor:
    """RGB (N, 3, 256) in [0, 1] of colour TFs in scaled CIELAB (N, 3, 256).

    The inverse of :func:`encode_colors`, as a differentiable function.
    """
    low, high = (color_tf.new_tensor(bound)[:, None] for bound in (LAB_LOW, LAB_HIGH))
    lightness, a, b = (low + (color_tf + 1) / 2 * (high - low)).unbind(1)
    y = (lightness + 16) / 116
    roots = torch.stack([y + a / 500, y, y - b / 200], dim=1)
    # CIE's definition of CIELAB, with its straight part near black.
    straight = (roots - 4 / 29) * 3 * (6 / 29) ** 2
    xyz = torch.where(roots > 6 / 29, roots**3, straight) * roots.new_tensor(WHITE)[:, None]
    linear = torch.einsum("rx,nxb->nrb", xyz.new_tensor(XYZ_TO_RGB), xyz).clamp(0, 1)
    # sRGB's transfer curve; its root has no derivative at 0.
    curved = 1.055 * linear.clamp_min(1e-6) ** (1 / 2.4) - 0.055
    return torch.where(linear > 0.0031308, curved, 12.92 * linear)
