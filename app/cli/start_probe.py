"""The window's start in a process of its own: ``python -m app.cli.start_probe FILE TIME``."""

from __future__ import annotations

import json
import os
import sys
import time
from functools import partial
from pathlib import Path

PATIENCE_S = 120.0


def probe(volume: Path, began: float) -> dict[str, float]:
    """Open a volume in the window, off screen, and wait for its images.

    Parameters
    ----------
    volume : Path
    began : float
        Time at which the process was started, in seconds since 1970.

    Returns
    -------
    dict of float
        Seconds from the start to the ``window``, to the first picture of the ``reference`` and of
        the ``generator``, if there is one, and to the last of both (``settled``); and the largest
        ``memory`` of the process, in MB.
    """
    if sys.platform == "linux":
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    from app.quick_imports import leave_sources_unread

    leave_sources_unread()
    from PySide6.QtCore import QCoreApplication, QEventLoop
    from PySide6.QtWidgets import QApplication

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
    window.workspace.open_volume(volume)
    window.show()
    note("window")
    end = time.time() + PATIENCE_S
    while time.time() < end and not ("reference" in found and window.workspace.is_settled):
        QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 5)
        time.sleep(0.001)
    note("settled")
    found["memory"] = _largest_memory()
    window.close()
    return found


def _largest_memory() -> float:
    """Largest resident memory of this process so far, in MB."""
    import resource

    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest / 1e6 if sys.platform == "darwin" else largest * 1024 / 1e6


if __name__ == "__main__":
    print(json.dumps(probe(Path(sys.argv[1]), float(sys.argv[2]))))
