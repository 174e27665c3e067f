"""Compile groups of kernels: ``python -m app.prepare_kernels uint8-path-images ...``.

The window starts this in a process of low priority and writes the names of groups to it, one per
line. Once a name is written back, the window loads that group's kernels. Numba compiles on one
thread and holds the interpreter's lock: in the window's own process it would block everything.
"""

import os
import sys
from collections.abc import Iterable

from model.kernel_cache import KernelGroup

NICENESS = 3  # low priority: the window comes first


def main(names: Iterable[str]) -> int:
    """Compile the groups of these names that were not compiled before; return the exit code 0."""
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    for name in names:
        group = KernelGroup.named(name.strip())
        if not group.is_prepared:
            # Imported late: other processes may have compiled all groups by now.
            from app.engines.compilation import prepare

            prepare(group)
            group.note_prepared()
        print(group.name, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or sys.stdin))
