"""The device that networks run on."""

from __future__ import annotations

import torch

from model.errors import DeviceError


def choose_device(name: str) -> torch.device:
    """Return the available device for "auto", "cpu" or "cuda".

    Raises :class:`DeviceError` when the name is unknown or the machine has no such device.
    """
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    if name not in ("cpu", "cuda"):
        raise DeviceError(f"The device '{name}' is unknown; choose auto, cpu or cuda.")
    if name == "cuda" and not torch.cuda.is_available():
        raise DeviceError(
            "The device 'cuda' is not there: torch sees no NVIDIA GPU; "
            "choose cpu, or install torch's CUDA build and the driver."
        )
    return torch.device(name)
