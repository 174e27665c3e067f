"""Size of this process: memory and open files; zeros where the system does not tell."""

from __future__ import annotations

import re
from pathlib import Path


def resident_mb() -> float:
    """Resident memory of this process, in MB."""
    try:
        found = re.search(r"VmRSS:\s+(\d+)", Path("/proc/self/status").read_text())
    except OSError:
        return 0.0
    return int(found[1]) / 1024 if found else 0.0


def open_handles() -> int:
    """Number of this process' open files, sockets and pipes."""
    handles = Path("/proc/self/fd")
    return len(list(handles.iterdir())) if handles.is_dir() else 0
