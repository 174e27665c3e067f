"""How training steps are computed: precision, order in memory, optimizer, compilation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import torch

Precision = Literal["float32", "bfloat16"]


@dataclass(frozen=True)
class Execution:
    """How optimization steps are computed.

    Attributes
    ----------
    precision : {"float32", "bfloat16"}
        Of the layers that allow for fewer digits; weights are float32.
    channels_last : bool
        Order of images and convolution weights in memory.
    fused : bool
        Whether the optimizer moves all weights in one go.
    compiled : bool
        Whether the generator is compiled by torch.
    """

    precision: Precision = "float32"
    channels_last: bool = True
    fused: bool = True
    compiled: bool = False

    @property
    def dtype(self) -> torch.dtype:
        """The precision as torch names it."""
        return {"float32": torch.float32, "bfloat16": torch.bfloat16}[self.precision]

    def __str__(self) -> str:
        order = "channels last" if self.channels_last else "channels first"
        parts = [self.precision, order, "fused optimizer" if self.fused else "plain optimizer"]
        return ", ".join([*parts, *(["compiled"] if self.compiled else [])])


STANDARD = Execution()
"""What is fast everywhere, if not the fastest."""
