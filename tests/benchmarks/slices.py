"""Slices of 512^3 voxels that the real window shows a second while the wheel scrolls them."""

import time
from functools import partial
from tempfile import TemporaryDirectory

from PySide6.QtCore import QPointF
from PySide6.QtWidgets import QApplication

from tests.app.mouse_events import wheel
from tests.benchmarks.motion import PATIENCE_S, close_window, opened_window, run, windows_here
from tests.benchmarks.opening import made
from tests.benchmarks.rows import options, parsed, print_rows


def scrolled(view, seconds, step):
    """Slices that are painted a second while a wheel turns forth and back."""
    at = QPointF(view.rect().center())
    shown, begun, up, box = 0, time.perf_counter(), 1, view.number
    while time.perf_counter() - begun < seconds:
        if box.value() in (0, box.maximum()):
            up = -1 if box.value() else 1
        wheel(view.viewport(), at, up)
        step()
        shown += 1
    return shown / (time.perf_counter() - begun)


def main(arguments=None):
    parser = options(__doc__, seconds=5.0, side=512)
    asked = parsed(parser, arguments)
    with windows_here(), TemporaryDirectory() as folder:
        path = asked.volume[0] if asked.volume else made(folder, asked.side, "int16")
        window = opened_window(path)
        run(PATIENCE_S, lambda: window.workspace.opened is not None)
        run(PATIENCE_S, lambda: window.workspace.is_settled)
        window.slices.toggle()
        rows = []
        for colors, action in window.slices.column.choices.items():
            action.trigger()
            scroll = partial(scrolled, seconds=asked.seconds, step=QApplication.processEvents)
            rows.append((colors, *map(scroll, window.slices.column.views)))
        print_rows(path.name, ("colours", "level/s", "front/s", "side/s"), rows)
        close_window(window)


if __name__ == "__main__":
    main()
