"""The small 2-D network that corrects images of a coarse volume."""

from __future__ import annotations

from typing import cast

import torch
from torch import Tensor, nn
from torch.nn.functional import (
    avg_pool2d,
    interpolate,
    leaky_relu,
    pixel_shuffle,
    pixel_unshuffle,
)

LEAK = 0.1


class Block(nn.Module):
    """Two convolutions with a shortcut; without batch norm, as images keep their brightness."""

    def __init__(self, channels_in: int, channels_out: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(channels_in, channels_out, 3, padding=1)
        self.second = nn.Conv2d(channels_out, channels_out, 3, padding=1)
        self.shortcut: nn.Module = nn.Identity()
        if channels_in != channels_out:
            self.shortcut = nn.Conv2d(channels_in, channels_out, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, channels_in, H, W) to (N, channels_out, H, W)."""
        y = leaky_relu(self.first(x), LEAK)
        return leaky_relu(self.second(y) + self.shortcut(x), LEAK)


class Refiner(nn.Module):
    """A small U-Net that corrects the colours of the last four channels, which are RGBA.

    The opacity stays as it is: it does not depend on the light, and a network finds nothing
    to correct in it. It starts as the identity, and is trained to be better than that. It
    works on blocks of 2 x 2 pixels as channels, which takes half the time of the same
    number of weights at full resolution.

    Parameters
    ----------
    channels_in : int
    width : int
        Channels at half of the resolution; twice as many at a quarter.
    """

    def __init__(self, channels_in: int, width: int) -> None:
        super().__init__()
        self.upper = Block(4 * channels_in, width)
        self.lower = Block(width, 2 * width)
        self.back = Block(3 * width, width)
        self.correction = nn.Conv2d(width, 12, 3, padding=1)
        nn.init.zeros_(self.correction.weight)
        nn.init.zeros_(cast(Tensor, self.correction.bias))

    def forward(self, images: Tensor) -> Tensor:
        """Map images (N, channels_in, S, S), S divisible by 4, to colours (N, 3, S, S)."""
        half = self.upper(pixel_unshuffle(images, 2))
        quarter = self.lower(avg_pool2d(half, 2))
        larger = interpolate(quarter, scale_factor=2, mode="bilinear", align_corners=False)
        half = self.back(torch.cat([larger, half], dim=1))
        return images[:, -4:-1] + pixel_shuffle(self.correction(half), 2)
