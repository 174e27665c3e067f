"""The very first start, in an empty home: seconds until there is something to see.

With ``--probe`` it is the program itself, in a process of its own.
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
    "pair": "generator beside it",
    "prepared": "all prepared",
}

PATIENCE_S = 300


def main(arguments: Sequence[str] | None = None) -> None:
    """Start the program a few times, each time in a home of its own, and print each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2, help="starts")
    parser.add_argument("--probe", type=float, metavar="TIME", help="when the process was started")
    parser.add_argument(
        "--without-opengl", action="store_true", help="as where VTK finds nothing to draw with"
    )
    asked = parser.parse_args(arguments)
    if asked.probe is not None:
        print(json.dumps(probe(asked.probe, asked.without_opengl)))
        return
    print_machine()
    rows = []
    for number in range(asked.count):
        found = _measured(asked.without_opengl)
        rows.append((f"start {number + 1}", *(found.get(name) for name in COLUMNS)))
    print_rows("From the start of the program, s", ("", *COLUMNS.values()), rows)


def _measured(without_opengl: bool) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as home:
        own = {f"XDG_{kind}_HOME": f"{home}/{kind}" for kind in ("CACHE", "CONFIG", "DATA")}
        command = [sys.executable, "-m", "tests.benchmarks.first_start"]
        if without_opengl:
            command.append("--without-opengl")
        done = subprocess.run(
            [*command, "--probe", str(time.time())],
            cwd=ROOT,
            env=os.environ | own | {"HOME": home},
            capture_output=True,
            text=True,
            check=True,
        )
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def probe(began: float, without_opengl: bool) -> dict[str, float]:
    """Run the program off screen, as without arguments, until all kernels are compiled."""
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
            _watch(window, began, found)

        launch._open = open_watched
        if without_opengl:
            _hide_opengl()

    app.quick_imports.leave_sources_unread = then_watch
    run([])
    return found


def _watch(window: MainWindow, began: float, found: dict[str, float]) -> None:
    """Note when what was asked for is there, and then end the program."""
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    work = window.workspace.reference

    def note(name: str) -> None:
        found.setdefault(name, time.time() - began)
        if len(found) == len(COLUMNS):
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
    work.preparation.progressed.connect(note_prepared)
    QTimer.singleShot(0, partial(note, "window"))
    QTimer.singleShot(1000 * PATIENCE_S, QApplication.quit)


def _hide_opengl() -> None:
    from model.errors import CannotDrawError
    from model.rendering import vtk_renderer

    def found_nowhere() -> None:
        raise CannotDrawError("VTK finds no OpenGL to draw with.")

    vtk_renderer.offscreen_window = found_nowhere  # type: ignore[assignment]


if __name__ == "__main__":
    main()
