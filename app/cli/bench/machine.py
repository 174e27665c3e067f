"""Description of the machine and software that measurements depend on."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from typing import Any

import torch

from app.cli.console import console
from model.measurements import processor_name


def print_machine(device: torch.device | None = None) -> dict[str, Any]:
    """Print and return a description of the machine; with a device, also torch's threads."""
    facts = _machine()
    if device is not None:
        facts |= {"threads": torch.get_num_threads(), "device": str(device)}
    console.print(machine_text(facts))
    return facts


def machine_text(facts: dict[str, Any]) -> str:
    """Describe a machine in a line."""
    return ", ".join(f"{name} {value}" for name, value in facts.items())


def _machine() -> dict[str, Any]:
    return {
        "processor": processor_name(),
        "instructions": torch.backends.cpu.get_cpu_capability(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        **{name: version(name) for name in ("vtk", "numba", "torch")},
    }
