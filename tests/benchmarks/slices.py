"""Slices of 512^3 voxels that the real window shows a second while the wheel scrolls them."""

import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PySide6.QtCore import QPointF
from PySide6.QtWidgets import QApplication

from tests.app.mouse_events import wheel
from tests.benchmarks.motion import PATIENCE_S, close_window, opened_window, run, windows_here
from tests.benchmarks.rows import options, parsed, print_rows


def written(folder, side):
    """A raw volume of short integers, in which no two slices are alike."""
    path = Path(folder) / f"ramp_{side}x{side}x{side}_int16.raw"
    ramp = np.linspace(-1000, 1000, side**2, dtype=np.int16).reshape(side, side)
    with path.open("wb") as file:
        for number in range(side):
            file.write(np.roll(ramp, 7 * number * side + 3 * number).tobytes())
    return path


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
        path = asked.volume[0] if asked.volume else written(folder, asked.side)
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
