"""The child process: reads one file after the other, and reports what became of each."""

import os
import re
import sys
import traceback
from contextlib import suppress
from pathlib import Path

MEMORY_FACTOR, MEMORY_MARGIN = 3, 200e6
"""A file may take so many times its size, and so many bytes more."""

MOST_MEMORY = 4 << 30  # bytes of address space beyond those of the libraries


def main(pipe, name):
    """Read the files whose paths come through a pipe; send an answer for each."""
    for printed in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), printed)
    from model.errors import TfscopeError
    from tests.fuzz.formats import FORMATS

    kind = FORMATS[name]
    is_limited = False
    while True:
        path = pipe.recv()
        before = _reset_peak()
        try:
            answer = {"outcome": "read", "digest": kind.read(path)}
        except TfscopeError as error:
            answer = {"outcome": "refused", "report": str(error)}
        except BaseException:
            answer = {"outcome": "error", "report": traceback.format_exc()}
        used = _status("VmHWM") - before
        if is_limited and used > MEMORY_FACTOR * _size(path) + MEMORY_MARGIN:
            answer = {"outcome": "memory", "report": f"{used / 1e6:.0f} MB; {answer}"}
        if not is_limited:
            # The first file is whole, and has all libraries loaded.
            _limit_memory()
            is_limited = True
        pipe.send(answer)


def _size(path):
    files = [path] if path.is_file() else [f for f in path.rglob("*") if f.is_file()]
    return sum(file.stat().st_size for file in files)


def _reset_peak():
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return _status("VmRSS")


def _status(name):
    """Bytes that the system tells of this process; 0 where it tells nothing."""
    try:
        found = re.search(rf"{name}:\s+(\d+)", Path("/proc/self/status").read_text())
    except OSError:
        return 0
    return int(found[1]) * 1024 if found else 0


def _limit_memory():
    if sys.platform == "linux":
        import resource

        limit = _status("VmSize") + MOST_MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
