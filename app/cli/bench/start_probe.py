"""The window's start in a process: ``python -m app.cli.bench.start_probe FILE TIME [MODEL]``."""

from __future__ import annotations

import gc
import json
import os
import sys
import time
from functools import partial
from pathlib import Path

PATIENCE_S = 120.0
REST_S = 4.0


def probe(volume: Path, began: float, model: Path | None = None) -> dict[str, float]:
    """Open a volume in the window, off screen, and wait for its images.

    Parameters
    ----------
    began : float
        Time at which the process was started, in seconds since 1970.
    model : Path or None
        Folder of a model; None for a shipped one of the volume, if there is one.

    Returns
    -------
    dict of float
        Seconds from the start to the ``window``, to the first picture of the ``reference`` and of
        the ``generator``, if there is one, and to the last of both (``settled``); the largest
        ``memory`` of the process until then, and that at ``rest`` some seconds later, in MB.
    """
    if sys.platform == "linux":
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    from app.quick_imports import leave_sources_unread

    leave_sources_unread()
    gc.disable()
    from PySide6.QtWidgets import QApplication

    from app.cli.bench.window_pace import wait
    from app.launch import garbage_collected_here
    from app.theme import apply_theme
    from app.window.main_window import MainWindow

    application = QApplication([])
    apply_theme(application)
    window = MainWindow()
    found: dict[str, float] = {}

    def note(name: str, *_shown: object) -> None:
        found.setdefault(name, time.time() - began)

    window.reference.imageShown.connect(partial(note, "reference"))
    window.generator.imageShown.connect(partial(note, "generator"))
    window.workspace.reading.open(volume)
    if model is not None:
        window.workspace.open_model(model)
    window.show()
    note("window")

    with garbage_collected_here():
        wait(lambda: "reference" in found and window.workspace.is_settled, PATIENCE_S)
        note("settled")
        found["memory"] = _largest_memory()
        # Engines that rest give spare memory back.
        wait(lambda: False, REST_S)
        resident = _resident_memory()
        if resident is not None:
            found["rest"] = resident
    window.close()
    return found


def _largest_memory() -> float:
    """Largest resident memory of this process so far, in MB."""
    import resource

    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest / 1e6 if sys.platform == "darwin" else largest * 1024 / 1e6


def _resident_memory() -> float | None:
    """Resident memory of this process now, in MB; None where the system does not tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return None
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    folder = Path(sys.argv[3]) if len(sys.argv) > 3 else None
    print(json.dumps(probe(Path(sys.argv[1]), float(sys.argv[2]), folder)))
