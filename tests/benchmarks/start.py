"""Seconds from the first start of the program until there is something to see.

It is in an empty home, where no kernel is compiled. With `--probe` it is the program itself, in a
process of its own.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from functools import partial
from unittest.mock import Mock

from tests.benchmarks.rows import parsed, print_rows, probed

COLUMNS = {
    "window": "window",
    "picture": "first picture",
    "path": "first path-traced picture",
    "pair": "generator's picture",
    "prepared": "all prepared",
}

PATIENCE_S = 300


def main(arguments=None):
    """Start the program a few times, and print each start."""
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["--probe"]:
        print(json.dumps(probe(float(words[1]), "--without-opengl" in words)))
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2, help="of starts")
    help_ = "as where VTK finds nothing to draw with"
    parser.add_argument("--without-opengl", action="store_true", help=help_)
    asked = parsed(parser, words)
    hidden = ["--without-opengl"] if asked.without_opengl else []
    rows = []
    for number in range(1, asked.count + 1):
        with tempfile.TemporaryDirectory() as home:
            own = {f"XDG_{kind}_HOME": f"{home}/{kind}" for kind in ("CACHE", "CONFIG", "DATA")}
            found = probed("start", time.time(), *hidden, **own, HOME=home)
        rows.append((f"start {number}", *map(found.get, COLUMNS)))
    print_rows("From the start of the program, s", ("", *COLUMNS.values()), rows)


def probe(began, without_opengl):
    """Run the program off screen until all kernels are compiled and the last picture is there."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ.setdefault("QT_LOGGING_RULES", "default.warning=false")
    import app.quick_imports
    from app.cli import run

    found = {}
    quicken = app.quick_imports.leave_sources_unread

    def then_watch():
        # No earlier than the program itself imports the window.
        quicken()
        from app import launch

        open_files = launch._open

        def open_watched(window, start):
            open_files(window, start)
            _watch(window, began, found)

        launch._open = open_watched
        if without_opengl:
            _hide_opengl()

    app.quick_imports.leave_sources_unread = then_watch
    run([])
    return found


def _watch(window, began, found):
    """Note when there is what the columns name, and then end the program."""
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    work = window.workspace.reference

    def note(name):
        found.setdefault(name, time.time() - began)
        if "prepared" in found and "picture" in found and window.workspace.is_settled:
            QApplication.quit()

    def note_picture(*_shown):
        note("picture")
        if work.settings.lighting == "path":
            note("path")

    window.reference.imageShown.connect(note_picture)
    window.generator.imageShown.connect(lambda *_shown: note("pair"))
    window.workspace.settled.connect(lambda: note("window"))
    work.preparation.progressed.connect(
        lambda done, wanted: note("prepared") if done == wanted > 0 else None
    )
    QTimer.singleShot(0, partial(note, "window"))
    QTimer.singleShot(1000 * PATIENCE_S, QApplication.quit)


def _hide_opengl():
    from model.errors import CannotDrawError
    from model.rendering import vtk_renderer

    vtk_renderer.offscreen_window = Mock(side_effect=CannotDrawError("VTK finds no OpenGL."))


if __name__ == "__main__":
    main()
