"""The network that improves denoised path-traced pictures of few samples.

One network for all volumes, TFs, views and lights. It corrects the denoised picture by the unlit
and the softly lit picture of the same scene. It goes beyond the paper, whose networks learn all of
one volume's pictures.
"""

import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch
import torch
from torch import Tensor, nn

from model.errors import CheckpointError, os_errors_as
from model.files import write_atomically
from model.networks.checkpoint import half_precision, network_with

COLORS = ("unlit", "soft", "denoised", "traced")
"""Inputs with three channels each, linear RGB times opacity: without light, in soft light, and the
path-traced picture, denoised and not."""

CHANNELS = 3 * len(COLORS) + 2  # of the input: `COLORS`, opacity, and 1 / sqrt(samples)
BRIGHTEST = 2.0  # radiance at which single samples are limited
MULTIPLE = 16  # the input's rows and columns are padded to a multiple of this


@dataclass(frozen=True)
class PathLightSize:
    """Channels at half of the picture's resolution; coarser levels have up to twice as many."""

    width: int = 40

    def __post_init__(self) -> None:
        if not (isinstance(self.width, int) and 4 <= self.width <= 512):
            raise ValueError("the width of the network behind the denoiser is 4 to 512")


class PathLightNetwork(nn.Module):
    """A U-Net from half resolution, whose outputs are factors of its input's colours.

    Blocks of 2 x 2 pixels become one pixel with four times the channels. This is four times as fast
    as full resolution, and keeps details, as its factors multiply colours of full resolution.
    """

    def __init__(self, size: PathLightSize) -> None:
        super().__init__()
        w = size.width
        widths = (w, w * 3 // 2, 2 * w, 2 * w)
        self.down = nn.ModuleList()
        channels = 4 * CHANNELS
        for width in widths:
            self.down.append(_block(channels, width))
            channels = width
        self.up = nn.ModuleList()
        for width in widths[-2::-1]:
            self.up.append(_block(channels + width, width))
            channels = width
        self.out = nn.Conv2d(channels, 4 * 9, 1)
        # Untrained, it changes nothing.
        for parameter in self.out.parameters():
            nn.init.zeros_(parameter)

    def forward(self, inputs: Tensor) -> Tensor:
        """Improve pictures."""
        hidden, skips = nn.functional.pixel_unshuffle(inputs, 2), []
        for number, block in enumerate(self.down):
            hidden = block(hidden if number == 0 else nn.functional.avg_pool2d(hidden, 2))
            skips.append(hidden)
        for block, skip in zip(self.up, skips[-2::-1], strict=True):
            wide = nn.functional.interpolate(hidden, scale_factor=2.0, mode="nearest")
            hidden = block(torch.cat([wide, skip], 1))
        found = nn.functional.pixel_shuffle(self.out(hidden), 2)
        factor, added, lit = found[:, :3], found[:, 3:6], found[:, 6:]
        soft, denoised = inputs[:, 3:6], inputs[:, 6:9]
        opacity = inputs[:, 12:13]
        changed = denoised * torch.exp(factor.clamp(-4, 4)) + (soft * lit + added) * opacity
        return changed.clamp(min=0)


def network_inputs(colors: dict[str, Tensor], opacity: Tensor, samples: int) -> Tensor:
    """Return the input (N, CHANNELS, h, w) for :data:`COLORS` and opacity, channels first."""
    found = [colors[name] for name in COLORS]
    found[-1] = found[-1].clamp(max=BRIGHTEST)
    noise = torch.full_like(opacity, 1 / math.sqrt(samples))
    return torch.cat([*found, opacity, noise], 1)


def permuted(inputs: Tensor, order: Tensor) -> Tensor:
    """Return an input with the channels of all colours in another order (3)."""
    channels = torch.arange(inputs.shape[1])
    for first in range(0, 3 * len(COLORS), 3):
        channels[first : first + 3] = first + order
    return inputs[:, channels]


def _block(channels: int, width: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(channels, width, 3, padding=1),
        nn.ReLU(inplace=True),
        nn.Conv2d(width, width, 3, padding=1),
        nn.ReLU(inplace=True),
    )


FORMAT = "tfscope_path_light"
VERSION = 1


@dataclass(frozen=True)
class PathLightCard:
    """Metadata of a path-light network."""

    size: PathLightSize
    training: dict[str, Any] = field(default_factory=dict)  # volumes, pairs, steps and time
    errors: dict[str, Any] = field(default_factory=dict)  # RMSE on held-out pairs, by samples


def save_path_light(path: Path, card: PathLightCard, network: PathLightNetwork) -> None:
    """Write a network in half precision atomically, or raise `CheckpointError`."""
    weights = {name: half_precision(value) for name, value in network.state_dict().items()}
    about = {FORMAT: VERSION, **asdict(card)}
    content = safetensors.torch.save(weights, {FORMAT: json.dumps(about, allow_nan=False)})
    what = f"{path}: the network cannot be written"
    with os_errors_as(CheckpointError, what, "choose another file"):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content)


def load_path_light(path: Path) -> tuple[PathLightCard, PathLightNetwork]:
    """Read a network, in evaluation mode, in float32, on the CPU; or raise `CheckpointError`."""
    what = f"{path}: the network cannot be read"
    try:
        with os_errors_as(CheckpointError, what), safetensors.safe_open(path, "pt") as file:
            about = json.loads((file.metadata() or {}).get(FORMAT, "null"))
            weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (safetensors.SafetensorError, ValueError) as error:
        raise CheckpointError(
            f"{path}: the file is damaged ({error}); copy or install it again."
        ) from error
    card = _card(path, about)
    return card, network_with(path, weights, lambda: PathLightNetwork(card.size))


def _card(path: Path, about: Any) -> PathLightCard:
    if not isinstance(about, dict) or about.get(FORMAT) != VERSION:
        raise CheckpointError(
            f"{path}: the file holds no network behind the denoiser that this version reads; "
            "choose another file, or train one with 'light train'."
        )
    try:
        size = PathLightSize(int(about["size"]["width"]))
        return PathLightCard(size, dict(about["training"]), dict(about["errors"]))
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError(
            f"{path}: the description of the network is damaged ({error}); install it again."
        ) from error
