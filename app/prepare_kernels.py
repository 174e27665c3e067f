"""Compile a group of kernels: ``python -m app.prepare_kernels VOXELS LIGHT PURPOSE``.

The window runs this beside it, at low priority, and loads what was compiled. Numba compiles on one
thread at a time and holds the interpreter's lock meanwhile, so that in the window's own process
nothing else would move.
"""

from __future__ import annotations

import os
import sys

from model.kernel_cache import KernelGroup

NICENESS = 10


def main(voxels: str, lighting: str, purpose: str) -> int:
    """Compile a group unless it was compiled before; return the exit code 0."""
    group = KernelGroup(voxels, lighting, "images" if purpose == "images" else "questions")
    if group.is_prepared:
        return 0
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    # Late: other processes may have compiled it meanwhile.
    from app.engines.preparation import prepare

    prepare(group)
    group.note_prepared()
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
