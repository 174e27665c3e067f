"""Seconds from the start of the program until there is something to see, and its memory.

The very first start is in an empty home, where no kernel is compiled. With ``--probe`` it is the
program itself, in a process of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tests.benchmarks.rows import print_machine, print_rows

if TYPE_CHECKING:
    from app.window.main_window import MainWindow

ROOT = Path(__file__).resolve().parents[2]

COLUMNS = {
    "window": "window",
    "picture": "first picture",
    "path": "first path-traced picture",
    "pair": "generator's picture",
    "prepared": "all prepared",
    "settled": "last picture",
    "memory": "most memory, MB",
}

PATIENCE_S = 300


def main(arguments: Sequence[str] | None = None) -> None:
    """Start the program a few times, and print each start."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--volume", type=Path, help="opened by each start")
    parser.add_argument("--count", type=int, default=2, help="starts")
    parser.add_argument("--later", action="store_true", help="all starts but one are in one home")
    parser.add_argument(
        "--without-opengl", action="store_true", help="as where VTK finds nothing to draw with"
    )
    parser.add_argument("--probe", type=float, metavar="TIME", help="when the process was started")
    asked = parser.parse_args(arguments)
    if asked.probe is not None:
        print(json.dumps(probe(asked)))
        return
    print_machine()
    rows = []
    with tempfile.TemporaryDirectory() as one:
        for number in range(1, asked.count + 1):
            with tempfile.TemporaryDirectory() as own:
                found = _measured(one if asked.later else own, asked)
            rows.append((f"start {number}", *(found.get(name) for name in COLUMNS)))
    print_rows("From the start of the program, s", ("", *COLUMNS.values()), rows)


def _measured(home: str, asked: argparse.Namespace) -> dict[str, float]:
    own = {f"XDG_{kind}_HOME": f"{home}/{kind}" for kind in ("CACHE", "CONFIG", "DATA")}
    command = [sys.executable, "-m", "tests.benchmarks.start", "--probe", str(time.time())]
    if asked.volume is not None:
        command += ["--volume", str(asked.volume.absolute())]
    if asked.without_opengl:
        command.append("--without-opengl")
    environment = os.environ | own | {"HOME": home}
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def probe(asked: argparse.Namespace) -> dict[str, float]:
    """Run the program off screen until all kernels are compiled and the last picture is there."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    import app.quick_imports
    from app.cli import run

    found: dict[str, float] = {}
    quicken = app.quick_imports.leave_sources_unread

    def then_watch() -> None:
        # No earlier than the program itself imports the window.
        quicken()
        from app import launch

        open_files = launch._open

        def open_watched(window: MainWindow, start: launch.WindowStart) -> None:
            open_files(window, start)
            _watch(window, asked.probe, found)

        launch._open = open_watched
        if asked.without_opengl:
            _hide_opengl()

    app.quick_imports.leave_sources_unread = then_watch
    run([] if asked.volume is None else ["--volume", str(asked.volume)])
    found["memory"] = _largest_memory()
    return found


def _watch(window: MainWindow, began: float, found: dict[str, float]) -> None:
    """Note when there is what the columns name, and then end the program."""
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    work = window.workspace.reference

    def note(name: str) -> None:
        found.setdefault(name, time.time() - began)
        if "prepared" in found and "picture" in found and window.workspace.is_settled:
            found["settled"] = time.time() - began
            QApplication.quit()

    def note_picture(*_shown: object) -> None:
        note("picture")
        if work.settings.lighting == "path":
            note("path")

    def note_prepared(done: int, wanted: int) -> None:
        if done == wanted > 0:
            note("prepared")

    window.reference.imageShown.connect(note_picture)
    window.generator.imageShown.connect(lambda *_shown: note("pair"))
    window.workspace.settled.connect(lambda: note("window"))
    work.preparation.progressed.connect(note_prepared)
    QTimer.singleShot(0, partial(note, "window"))
    QTimer.singleShot(1000 * PATIENCE_S, QApplication.quit)


def _hide_opengl() -> None:
    from model.errors import CannotDrawError
    from model.rendering import vtk_renderer

    def found_nowhere() -> None:
        raise CannotDrawError("VTK finds no OpenGL to draw with.")

    vtk_renderer.offscreen_window = found_nowhere  # type: ignore[assignment]


def _largest_memory() -> float:
    """Largest resident memory of this process so far, in MB."""
    import resource

    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest / 1e6 if sys.platform == "darwin" else largest * 1024 / 1e6


if __name__ == "__main__":
    main()
