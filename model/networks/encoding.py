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

from model.scene.inputs import Arrays, SceneInputs, encode_inputs, store_inputs
from model.scene.scene import Scene


class EncodedInputs(NamedTuple):
    """Scene inputs of N images as network inputs, in [-1, 1].

    Attributes
    ----------
    conditions : Tensor, shape (N, C)
        The five view parameters (:meth:`model.scene.view.View.vector`), then those of the scene's
        other inputs, such as a movable light.
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
