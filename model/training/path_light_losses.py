"""Losses of the network behind the denoiser: the program's own, and the paper's to compare with."""

from __future__ import annotations

from typing import Any, get_args

import torch
from torch import Tensor, nn

from model.networks.blocks import ImageDiscriminator
from model.networks.names import PathLightLoss
from model.networks.path_light_network import CHANNELS
from model.training.losses import adversarial, l1

PATH_LIGHT_LOSSES: tuple[PathLightLoss, ...] = get_args(PathLightLoss)

L1_WEIGHT = 150.0
"""Of the l1 loss beside the adversarial one (paper, section 6.3.1)."""

ADVERSARY_RATE = 2e-4
"""Learning rate of the adversary, whose input are pictures, not differences of them."""


def distance(loss: PathLightLoss, found: Tensor, exact: Tensor) -> Tensor:
    """Return a loss's distance of finished pictures (N, 3, h, w) from exact ones."""
    if loss == "rms":
        # Averaged over pictures: dark ones count as bright ones do.
        return (found - exact).square().mean((1, 2, 3)).add(1e-6).sqrt().mean()
    return l1(found, exact)


class Adversary:
    """Tells finished pictures from exact ones, place by place, given the network's input.

    It is the paper's (section 4) but for scores of places in place of one of the whole picture.

    Parameters
    ----------
    device : torch.device
    """

    def __init__(self, device: torch.device) -> None:
        *halvings, _, _, _ = ImageDiscriminator([CHANNELS + 3, 32, 64, 128], 1)
        self._scores = nn.Sequential(*halvings, nn.Conv2d(128, 1, 3, padding=1)).to(device)
        self._optimizer = torch.optim.Adam(
            self._scores.parameters(), ADVERSARY_RATE, betas=(0.5, 0.999)
        )

    def learn(self, inputs: Tensor, found: Tensor, exact: Tensor) -> None:
        """Take a step towards telling `found` from `exact`."""
        logits = [self._judged(inputs, pictures) for pictures in (exact, found.detach())]
        loss = adversarial(logits[0], 1.0) + adversarial(logits[1], 0.0)
        self._optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        self._optimizer.step()

    def loss(self, inputs: Tensor, found: Tensor) -> Tensor:
        """Return how surely finished pictures are told from exact ones, for an l1 loss of 1."""
        return adversarial(self._judged(inputs, found), 1.0) / L1_WEIGHT

    def state(self) -> dict[str, Any]:
        """Return what a checkpoint keeps."""
        return {"scores": self._scores.state_dict(), "optimizer": self._optimizer.state_dict()}

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on from what a checkpoint kept."""
        self._scores.load_state_dict(state["scores"])
        self._optimizer.load_state_dict(state["optimizer"])

    def _judged(self, inputs: Tensor, pictures: Tensor) -> Tensor:
        logits: Tensor = self._scores(torch.cat([inputs, pictures], 1))
        return logits
