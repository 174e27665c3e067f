"""Results of measurements on this machine, cached in the user's cache folder."""

import hashlib
import json
import math
import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from model.files import cache_folder, write_atomically
from model.json_files import read_json

FILE = "measurements.json"
QUOTA = Path("/sys/fs/cgroup/cpu.max")  # of processor time, on Linux in a container


def kept(name: str, about: Mapping[str, Any]) -> Any:
    """Return the cached result of a measurement on this machine, or None if there is none.

    `about` is all that the result depends on besides the machine, as plain data.
    """
    return _read().get(_key(name, about))


def keep(name: str, about: Mapping[str, Any], result: Any) -> None:
    """Cache a result (plain data) for later runs; do nothing if it cannot be written."""
    with suppress(OSError):
        path = cache_folder() / FILE
        path.parent.mkdir(parents=True, exist_ok=True)
        content = json.dumps(_read() | {_key(name, about): result}, indent=1)
        write_atomically(path, content.encode())


def _read() -> dict[str, Any]:
    try:
        found = read_json(cache_folder() / FILE)
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _key(name: str, about: Mapping[str, Any]) -> str:
    facts = json.dumps([_machine(), dict(about)], sort_keys=True)
    return f"{name} {hashlib.sha256(facts.encode()).hexdigest()[:16]}"


def _machine() -> dict[str, Any]:
    """Return the properties that determine speed; machines with equal ones share results."""
    # Late: the processor's name needs none of it.
    import torch

    return {
        "processor": processor_name(),
        "instructions": torch.backends.cpu.get_cpu_capability(),
        # A processor with some of its instructions disabled counts as a different one.
        "limits": {n: os.environ.get(n) for n in ("ONEDNN_MAX_CPU_ISA", "DNNL_MAX_CPU_ISA")},
        "threads": torch.get_num_threads(),
        "torch": torch.__version__,
        "gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else None,
    }


@cache
def processor_name() -> str:
    """Return the processor's name as reported by the system."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def processors() -> int:
    """Return how many processors this process may use; a container may have a share of them."""
    if hasattr(os, "sched_getaffinity"):
        count = len(os.sched_getaffinity(0))
    else:
        count = os.cpu_count() or 1
    with suppress(OSError, ValueError):
        # "max 100000" without a limit, else the microseconds of all processors in a period.
        quota, period = QUOTA.read_text(encoding="utf-8").split()
        count = min(count, math.ceil(int(quota) / int(period)))
    return max(count, 1)
