"""Execution settings of training steps: precision, memory order, optimizer, compilation."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from model.training.options import Precision


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
    """

    precision: Precision = "float32"
    channels_last: bool = True
    fused: bool = True
    compiled: bool = False

    @property
    def dtype(self) -> torch.dtype:
        """The precision as a torch dtype."""
        return {"float32": torch.float32, "bfloat16": torch.bfloat16}[self.precision]

    def __str__(self) -> str:
        order = "channels last" if self.channels_last else "channels first"
        parts = [self.precision, order, "fused optimizer" if self.fused else "plain optimizer"]
        return ", ".join([*parts, *(["compiled"] if self.compiled else [])])


STANDARD = Execution()
"""Default settings: fast on all machines, though not always the fastest."""
