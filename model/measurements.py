"""Choices that were measured on this machine, kept in the user's cache folder."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import torch

from model.files import cache_folder, write_atomically

FILE = "measurements.json"


def kept(name: str, about: Mapping[str, Any]) -> Any:
    """Return what was kept on this machine; None where nothing was.

    Parameters
    ----------
    name : str
        Of the measurement.
    about : mapping
        All that the result depends on beside the machine, as plain data.
    """
    return _read().get(_key(name, about))


def keep(name: str, about: Mapping[str, Any], result: Any) -> None:
    """Keep a result, plain data, for later runs; where it cannot be written, nothing is kept."""
    with suppress(OSError):
        path = cache_folder() / FILE
        path.parent.mkdir(parents=True, exist_ok=True)
        content = json.dumps(_read() | {_key(name, about): result}, indent=1)
        write_atomically(path, content.encode())


def _read() -> dict[str, Any]:
    try:
        found = json.loads((cache_folder() / FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _key(name: str, about: Mapping[str, Any]) -> str:
    facts = json.dumps([_machine(), dict(about)], sort_keys=True)
    return f"{name} {hashlib.sha256(facts.encode()).hexdigest()[:16]}"


def _machine() -> dict[str, Any]:
    """What speed depends on: two machines that agree in this are taken for one."""
    return {
        "processor": processor_name(),
        "instructions": torch.backends.cpu.get_cpu_capability(),
        # The same processor with some of its instructions forbidden is another one.
        "limits": {n: os.environ.get(n) for n in ("ONEDNN_MAX_CPU_ISA", "DNNL_MAX_CPU_ISA")},
        "threads": torch.get_num_threads(),
        "torch": torch.__version__,
        "gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else None,
    }


@cache
def processor_name() -> str:
    """The processor's name as the system gives it."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
