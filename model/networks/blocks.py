"""Layers shared by the networks.

All network inputs and images lie in [-1, 1]. Generators use ReLU inside residual blocks; linear
layers, 1-D convolutions and discriminators use LeakyReLU(0.2) (paper, section 4.1).
"""

from itertools import pairwise
from typing import TypeVar

import torch
from torch import Tensor, nn
from torch.nn.functional import conv_transpose2d, interpolate, pad

from model.errors import TfscopeError

Network = TypeVar("Network", bound=nn.Module)

LEAK = 0.2


class DoublingConv2d(nn.Conv2d):
    """Convolution of kernel size 3 of an image that is first doubled along both axes.

    Nearest-neighbour doubling and the convolution are merged into one transposed convolution of the
    smaller image: equal results from 4/9 of the multiplications, in half the time.
    """

    def __init__(self, channels_in: int, channels_out: int, bias: bool = True) -> None:
        super().__init__(channels_in, channels_out, 3, padding=1, bias=bias)

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, channels_in, H, W) to (N, channels_out, 2 H, 2 W)."""
        # An input pixel reaches an output pixel through the weights of its doubles.
        spread = pad(self.weight, (1, 1, 1, 1))
        spread = spread[..., :-1, :] + spread[..., 1:, :]
        spread = spread[..., :-1] + spread[..., 1:]
        kernel = spread.flip(-2, -1).transpose(0, 1)
        return conv_transpose2d(x, kernel, self.bias, stride=2, padding=1)


class ResidualBlock(nn.Module):
    """Residual block of two convolutions and a shortcut (He et al. 2016)."""

    def __init__(
        self,
        channels_in: int,
        channels_out: int,
        kernel: int = 3,
        last: bool = False,
        doubles: bool = False,
    ) -> None:
        super().__init__()

        def norm() -> nn.Module:
            return nn.Identity() if last else nn.BatchNorm2d(channels_out)

        padding = kernel // 2
        self._doubles = doubles
        # The doubled image is not needed: the shortcut is doubled after its convolution, which has
        # a quarter of the pixels.
        self._in_one = doubles and kernel == 3
        first: nn.Module = nn.Conv2d(channels_in, channels_in, kernel, padding=padding, bias=False)
        if self._in_one:
            first = DoublingConv2d(channels_in, channels_in, bias=False)
        self.body = nn.Sequential(
            first,
            nn.BatchNorm2d(channels_in),
            nn.ReLU(),
            nn.Conv2d(channels_in, channels_out, kernel, padding=padding, bias=False),
            norm(),
        )
        self.shortcut: nn.Module = nn.Identity()
        if channels_in != channels_out:
            self.shortcut = nn.Sequential(
                nn.Conv2d(channels_in, channels_out, 1, bias=False), norm()
            )
        self.activation: nn.Module = nn.Identity() if last else nn.ReLU()

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, channels_in, H, W) to (N, channels_out, H, W), or to 2 H and 2 W."""
        if self._doubles and not self._in_one:
            x = doubled(x)
        shortcut = self.shortcut(x)
        if self._in_one:
            shortcut = doubled(shortcut)
        y: Tensor = self.activation(self.body(x) + shortcut)
        return y


class TFEncoder(nn.Sequential):
    """1-D convolutions that encode a TF (N, channels[0], 256) as a feature vector (N, features)."""

    def __init__(self, channels: list[int], features: int, bias: bool = True) -> None:
        layers: list[nn.Module] = []
        for a, b in pairwise(channels):
            layers += [nn.Conv1d(a, b, 5, stride=2, padding=2, bias=bias), nn.LeakyReLU(LEAK)]
        layers += [
            nn.Conv1d(channels[-1], features, 8, bias=bias),
            nn.LeakyReLU(LEAK),
            nn.Flatten(),
        ]
        super().__init__(*layers)


class ImageDiscriminator(nn.Sequential):
    """Strided convolutions that encode an image as one feature vector."""

    def __init__(self, channels: list[int], features: int) -> None:
        layers: list[nn.Module] = []
        for i, (a, b) in enumerate(pairwise(channels)):
            layers.append(nn.Conv2d(a, b, 4, stride=2, padding=1))
            if i > 0:
                layers.append(nn.BatchNorm2d(b))
            layers.append(nn.LeakyReLU(LEAK))
        layers += [nn.Conv2d(channels[-1], features, 4), nn.LeakyReLU(LEAK), nn.Flatten()]
        super().__init__(*layers)


class Modulation(nn.Module):
    """Scale and shift of features by linear functions of a code; initially near the identity."""

    def __init__(self, code: int, channels: int) -> None:
        super().__init__()
        self.linear = nn.Linear(code, 2 * channels)

    def start(self) -> None:
        """Initialize near the identity; call it after all other initialization."""
        nn.init.normal_(self.linear.weight, 0.0, 0.05)
        nn.init.zeros_(self.linear.bias)

    def forward(self, x: Tensor, code: Tensor) -> Tensor:
        """Modulate features (N, channels, H, W) by codes (N, code)."""
        scale, shift = self.linear(code).chunk(2, dim=1)
        return x * (1 + scale[:, :, None, None]) + shift[:, :, None, None]


def mlp(*features: int) -> nn.Sequential:
    """Return linear layers between these feature counts, each followed by LeakyReLU."""
    layers: list[nn.Module] = []
    for a, b in pairwise(features):
        layers += [nn.Linear(a, b), nn.LeakyReLU(LEAK)]
    return nn.Sequential(*layers)


def score_head(features_in: int, features: int) -> nn.Sequential:
    """Return layers that map concatenated features to one logit."""
    return nn.Sequential(mlp(features_in, features, features), nn.Linear(features, 1))


def doubled(x: Tensor) -> Tensor:
    """Double the pixels of images (N, C, H, W) along both axes by nearest neighbour."""
    return interpolate(x, scale_factor=2, mode="nearest")


def initialize(module: nn.Module) -> None:
    """Initialize weights like the paper's code: N(0, 0.02), batch norms N(1, 0.02)."""
    for layer in module.modules():
        if isinstance(layer, nn.Conv1d | nn.Conv2d | nn.Linear):
            nn.init.normal_(layer.weight, 0.0, 0.02)
            if layer.bias is not None:
                nn.init.zeros_(layer.bias)
        elif isinstance(layer, nn.BatchNorm2d):
            nn.init.normal_(layer.weight, 1.0, 0.02)
            nn.init.zeros_(layer.bias)
    _start_modulations(module)


def kaiming_init(module: nn.Module) -> None:
    """Apply Kaiming initialization to layers without batch norm (He et al. 2015).

    With N(0, 0.02) a narrow 1-D convolution attenuates its input to an eighth, and six of them
    suppress the TF: a generator of quarter width then learns to ignore colours.
    """
    for layer in module.modules():
        if isinstance(layer, nn.Conv1d | nn.Linear):
            nn.init.kaiming_normal_(layer.weight, LEAK, nonlinearity="leaky_relu")
    _start_modulations(module)


def _start_modulations(module: nn.Module) -> None:
    for layer in module.modules():
        if isinstance(layer, Modulation):
            layer.start()


def place(network: Network, device: torch.device) -> Network:
    """Move a network to a device, with convolution weights channels-last, usually the fastest."""
    network.to(device)
    network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    return network


def parameter_count(module: nn.Module) -> int:
    """Return the number of parameters."""
    return sum(p.numel() for p in module.parameters())


def choose_device(name: str) -> torch.device:
    """Return the device "auto", "cpu" or "cuda"; raise :class:`TfscopeError` if unavailable."""
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    if name not in ("cpu", "cuda"):
        raise TfscopeError(f"The device '{name}' is unknown; choose auto, cpu or cuda.")
    if name == "cuda" and not torch.cuda.is_available():
        raise TfscopeError(
            "The device 'cuda' is not available: torch sees no NVIDIA GPU; "
            "choose cpu, or install torch's CUDA build and the driver."
        )
    return torch.device(name)
