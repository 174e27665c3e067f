"""How long the window takes to show something, from the program's start, and its memory.

With ``--probe`` it is the window itself, in a process of its own.
"""

from __future__ import annotations

import gc
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from tests.benchmarks.rows import options, paths, print_machine, print_rows

ROOT = Path(__file__).resolve().parents[2]

COLUMNS = {
    "window": "window, s",
    "reference": "reference, s",
    "generator": "generator, s",
    "settled": "both final, s",
    "memory": "most memory, MB",
}

PATIENCE_S = 120.0


def main(arguments: Sequence[str] | None = None) -> None:
    """Start the window anew for each volume, the first time to compile; print medians."""
    parser = options(__doc__, count=3)
    parser.add_argument("--model", type=Path, help="opened beside the volume")
    parser.add_argument("--probe", type=float, metavar="TIME", help="when the process was started")
    asked = parser.parse_args(arguments)
    if asked.probe is not None:
        print(json.dumps(probe(asked.volume[0], asked.probe, asked.model)))
        return
    print_machine()
    rows = []
    for path in paths(asked):
        runs = [_measured(path, asked.model) for _ in range(asked.count + 1)][1:]
        medians = [
            statistics.median(run[name] for run in runs) if name in runs[0] else None
            for name in COLUMNS
        ]
        rows.append((path.name, *medians))
    print_rows("From the start of the program", ("volume", *COLUMNS.values()), rows)


def _measured(path: Path, model: Path | None) -> dict[str, float]:
    module = [sys.executable, "-m", "tests.benchmarks.start"]
    asked = ["--volume", str(path.absolute()), "--probe", str(time.time())]
    if model is not None:
        asked += ["--model", str(model.absolute())]
    done = subprocess.run([*module, *asked], cwd=ROOT, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def probe(volume: Path, began: float, model: Path | None) -> dict[str, float]:
    """Open a volume in the window, off screen, and wait for its images."""
    if sys.platform == "linux":
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    from app.quick_imports import leave_sources_unread

    leave_sources_unread()
    gc.disable()
    from PySide6.QtWidgets import QApplication

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
        _wait(lambda: "reference" in found and window.workspace.is_settled)
        note("settled")
        found["memory"] = _largest_memory()
    window.close()
    return found


def _wait(until: Callable[[], bool]) -> None:
    from PySide6.QtCore import QCoreApplication, QEventLoop

    end = time.monotonic() + PATIENCE_S
    while not until() and time.monotonic() < end:
        QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 5)
        time.sleep(0.001)


def _largest_memory() -> float:
    """Largest resident memory of this process so far, in MB."""
    import resource

    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest / 1e6 if sys.platform == "darwin" else largest * 1024 / 1e6


if __name__ == "__main__":
    main()
