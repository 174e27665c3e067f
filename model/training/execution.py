"""Execution settings of training steps: precision, memory order, optimizer, compilation."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from model.networks.names import Precision


@dataclass(frozen=True)
class Execution:
    """Execution settings of optimization steps.

    Attributes
    ----------
    precision : {"float32", "bfloat16"}
        Precision of the layers under autocast; weights are float32.
    channels_last : bool
        Whether convolution weights and images are stored channels-last.
    fused : bool
        Whether the optimizer is fused.
    compiled : bool
        Whether the generator is compiled by ``torch.compile``.
    recorded : bool
        Whether a GPU's steps without a discriminator are recorded once, as a CUDA graph, and
        then repeated: a step is thousands of small kernels, and starting each of them from
        Python takes longer than they do.
    """

    precision: Precision = "float32"
    channels_last: bool = True
    fused: bool = True
    compiled: bool = False
    recorded: bool = False

    @property
    def dtype(self) -> torch.dtype:
        """The precision as a torch dtype."""
        return {"float32": torch.float32, "bfloat16": torch.bfloat16}[self.precision]

    def __str__(self) -> str:
        order = "channels last" if self.channels_last else "channels first"
        parts = [self.precision, order, "fused optimizer" if self.fused else "plain optimizer"]
        more = {"compiled": self.compiled, "recorded": self.recorded}
        return ", ".join([*parts, *(name for name, is_so in more.items() if is_so)])


STANDARD = Execution()
"""Default settings: fast on all machines, though not always the fastest."""
