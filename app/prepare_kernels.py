"""Compile ahead what draws volumes' first images: ``python -m app.prepare_kernels``.

Numba compiles a renderer for each light and type of voxels when it is first used, which takes ten
seconds or more, while the window shows nothing new. The Makefile runs this once, on all processors;
what is left out is compiled when it is first used.
"""

from __future__ import annotations

import math
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

from model.kernel_cache import PREPARED, stamp


def main() -> int:
    """Prepare the common kernels unless that was done before; return the exit code 0."""
    if stamp().exists():
        return 0
    # As in the window: threads that wait busily would slow others down.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    # Late: mostly there is nothing to do.
    from app.engines.preparation import measure_path_light, prepare

    begun = time.perf_counter()
    print("Compiling the renderers for this processor, which takes a minute or two, once …")
    # Processes, as Numba compiles on one thread at a time.
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        jobs = {pool.submit(prepare, *one): one for one in PREPARED}
        for job in as_completed(jobs):
            if job.exception() is not None:
                voxels, lighting = jobs[job]
                # The program runs without it all the same.
                print(f"{voxels}, {lighting}: {job.exception()}", file=sys.stderr)
    seconds = math.inf
    try:
        if ("uint8", "path") in PREPARED:
            # With all processors, as in the window.
            seconds = measure_path_light()
    except Exception as error:
        print(f"path-traced light: {error}", file=sys.stderr)
    try:
        stamp().write_text(f"{seconds:.3f}")
    except OSError as error:
        print(f"Nothing compiled could be kept: {error}", file=sys.stderr)
    print(f"… done in {time.perf_counter() - begun:.0f} s.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
