"""Training samples encoded as network inputs and targets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import adaptive_avg_pool2d

from model.networks.generator_network import EncodedInputs
from model.samples.sample_store import SampleBatch
from model.scene.scene import Scene

CPU = torch.device("cpu")


@dataclass(frozen=True)
class EncodedBatch:
    """Training samples as tensors in [-1, 1]; images are (N, 1, So, So) and (N, 3, S, S)."""

    inputs: EncodedInputs
    opacity_image: Tensor
    image: Tensor

    @property
    def tensors(self) -> list[Tensor]:
        """All tensors, in a fixed order."""
        return [*self.inputs, self.opacity_image, self.image]

    def __len__(self) -> int:
        return len(self.image)

    def parts(self, count: int) -> list[EncodedBatch]:
        """Split into about `count` parts; only the last may have an odd number of samples."""
        size = 2 * -(-len(self) // (2 * count))
        slices = [slice(start, start + size) for start in range(0, len(self), size)]
        return [self.map(itemgetter(part)) for part in slices]

    def map(self, function: Callable[[Tensor], Tensor]) -> EncodedBatch:
        """Apply a function to each tensor."""
        return EncodedBatch(
            self.inputs.map(function), function(self.opacity_image), function(self.image)
        )


def encode_batch(
    batch: SampleBatch, scene: Scene, opacity_size: int, device: torch.device = CPU
) -> EncodedBatch:
    """Encode stored samples on the device that trains.

    The opacity image is the image's opacity, averaged over blocks to `opacity_size` pixels.
    """
    if batch.encoded:
        inputs = EncodedInputs.encoded(batch.encoded)
    else:
        inputs = EncodedInputs.stored(batch.inputs, scene)
    # As bytes: a quarter of the size.
    rgba = torch.from_numpy(np.ascontiguousarray(batch.rgba)).to(device)
    # Channels stay last: permuting them takes longer.
    parts = rgba[..., :3], rgba[..., 3:]
    color, opacity = (part.float().div_(127.5).sub_(1) for part in parts)
    return EncodedBatch(
        inputs.map(lambda tensor: tensor.to(device)),
        adaptive_avg_pool2d(opacity.permute(0, 3, 1, 2), opacity_size),
        color.permute(0, 3, 1, 2),
    )
