"""Training samples as the networks see them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from model.networks.encoding import encode_colors, encode_unit, encode_views
from model.samples.sample_store import SampleBatch
from model.scene.view import ViewRange


@dataclass(frozen=True)
class EncodedBatch:
    """Training samples as tensors in [-1, 1], images NCHW.

    Attributes
    ----------
    view : Tensor, shape (N, 5)
    opacity_tf : Tensor, shape (N, 256)
    color_tf : Tensor, shape (N, 3, 256)
    opacity_image : Tensor, shape (N, 1, So, So)
    image : Tensor, shape (N, 3, S, S)
    """

    view: Tensor
    opacity_tf: Tensor
    color_tf: Tensor
    opacity_image: Tensor
    image: Tensor

    def to(self, device: torch.device) -> EncodedBatch:
        """The same batch on a device."""
        return EncodedBatch(**{name: value.to(device) for name, value in vars(self).items()})

    def __len__(self) -> int:
        return len(self.view)

    def parts(self, count: int) -> list[EncodedBatch]:
        """The batch in about as many parts; only the last may have an odd number of samples."""
        size = 2 * -(-len(self) // (2 * count))
        columns = {name: value.split(size) for name, value in vars(self).items()}
        return [
            EncodedBatch(**dict(zip(columns, part, strict=True)))
            for part in zip(*columns.values(), strict=True)
        ]


def encode_batch(batch: SampleBatch, view_range: ViewRange, opacity_size: int) -> EncodedBatch:
    """Encode stored samples.

    Parameters
    ----------
    batch : SampleBatch
    view_range : ViewRange
        The scene's.
    opacity_size : int
        Width and height of the opacity image: the image's opacity, averaged
        over square blocks of pixels.
    """
    rgba = torch.from_numpy(np.ascontiguousarray(batch.rgba.transpose(0, 3, 1, 2)))
    rgba = rgba.float() / 127.5 - 1
    opacity = torch.nn.functional.adaptive_avg_pool2d(rgba[:, 3:], opacity_size)
    return EncodedBatch(
        view=encode_views(batch.views(), view_range),
        opacity_tf=encode_unit(batch.opacity_tf),
        color_tf=encode_colors(batch.color_tf),
        opacity_image=opacity,
        image=rgba[:, :3].contiguous(),
    )
