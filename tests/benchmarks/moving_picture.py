"""A moving picture of the window for the README, from a script of mouse and keys at the real one.

`python -m tests.benchmarks.moving_picture --out resources/tfscope.webp` takes some minutes. Waits
for images are left out.
"""

import argparse
from pathlib import Path

from PIL.ImageQt import fromqpixmap
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPolygonF
from PySide6.QtTest import QTest

from model.volume_files.shipped import SCAN
from tests.benchmarks.motion import close_window, opened_window, run, windows_here

SIZE = 960, 640
STEP_MS = 80  # time that a picture is shown while something moves
LONGEST = 4e5  # bytes of the file

MOVING_S, TURNED_S, RESTING_S = 1.0, 20.0, 60.0
"""Longest waits for images of a drag, of one step of a turn, and at rest."""

ARROW = QPolygonF(
    [QPointF(*at) for at in ((0, 0), (0, 17), (4, 13), (7, 19), (10, 18), (7, 12), (12, 12))]
)


class Recording:
    """A window, the mouse over it, and the pictures so far with their times."""

    def __init__(self, window):
        self.window, self.pictures, self.times = window, [], []
        self.mouse = window.rect().center()

    def is_settled(self):
        return self.window.workspace.is_settled

    def rest(self, shown_ms, seconds=0.0):
        """Take a picture of the window at rest, after some more time for its questions."""
        run(0.5)
        run(RESTING_S, self.is_settled)
        run(seconds)
        self.take(shown_ms)

    def take(self, shown_ms=STEP_MS):
        """Take a picture, with the mouse in it."""
        picture = self.window.grab()
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.translate(self.mouse)
        painter.setPen(QColor("black"))
        painter.setBrush(QColor("white"))
        painter.drawPolygon(ARROW)
        painter.end()
        self.pictures.append(fromqpixmap(picture).convert("RGB"))
        self.times.append(shown_ms)

    def go(self, widget, at, steps=3):
        """Move the mouse to a place of a widget, without a button."""
        start, end = self.mouse, widget.mapTo(self.window, at)
        for part in (_eased(step / steps) for step in range(1, steps + 1)):
            self._move(widget, widget.mapFrom(self.window, start + (end - start) * part))
            run(0.05)
            self.take()

    def drag(self, widget, points, seconds=0.02):
        """Drag with the left button from the first place over the others, with time for each."""
        left = Qt.MouseButton.LeftButton
        QTest.mousePress(widget, left, pos=points[0])
        for point in points[1:]:
            self._move(widget, point)
            run(seconds)
            self.take()
        QTest.mouseRelease(widget, left, pos=points[-1])

    def _move(self, widget, place):
        self.mouse = widget.mapTo(self.window, place)
        QTest.mouseMove(widget, place)

    def save(self, path):
        """Write all pictures, at the best quality that is not too long."""
        first, others = self.pictures[0], self.pictures[1:]
        for quality in range(60, 10, -10):
            looks = {"duration": self.times, "loop": 0, "quality": quality, "method": 6}
            first.save(path, save_all=True, append_images=others, minimize_size=True, **looks)
            size = path.stat().st_size
            print(f"{path}: {len(self.pictures)} pictures, quality {quality}, {size:,} bytes")
            if size <= LONGEST:
                return


def play(recording):
    """Turn the volume, ask about a region, edit the TF, and take another one."""
    window = recording.window
    canvas, plot = window.generator.canvas, window.editor.area.widget.viewport()

    def on(right, down):
        return QPoint(round(right * canvas.width()), round(down * canvas.height()))

    run(3 * RESTING_S, recording.is_settled)
    recording.rest(1500, 4.0)
    recording.go(canvas, on(0.5, 0.6))
    right, left = Qt.Key.Key_Right, Qt.Key.Key_Left
    for key in (*4 * [right], *4 * [left]):
        QTest.keyClick(canvas, key)
        run(0.3)
        run(TURNED_S, recording.is_settled)  # both images are refined
        recording.take(2 * STEP_MS)
    recording.rest(700)
    # Region and curve.
    QTest.keyClick(window, Qt.Key.Key_R)
    recording.go(canvas, on(0.44, 0.3))
    corners = [on(0.44 + 0.2 * _eased(n / 8), 0.3 + 0.3 * _eased(n / 8)) for n in range(9)]
    recording.drag(canvas, corners)
    recording.rest(2200, 5.0)
    # One edit: muscles and organs.
    view = window.editor.area
    value, opacity = 110.0, 0.014
    scene = view.opacity.mapViewToScene(QPointF(view.axis.place(value), view.scale.height(opacity)))
    start = view.widget.mapFromScene(scene)
    recording.go(plot, start)
    recording.drag(plot, [start - QPoint(0, round(11 * n / 10)) for n in range(11)], MOVING_S)
    recording.rest(1800, 3.0)
    # The 16 pictures.
    QTest.keyClick(window, Qt.Key.Key_Delete, Qt.KeyboardModifier.ShiftModifier)
    QTest.keyClick(window, Qt.Key.Key_B)
    recording.rest(1200, 12.0)
    grid = window.browser.grid
    for right, down in ((0.12, 0.12), (0.88, 0.62), (0.38, 0.88)):
        recording.go(grid, QPoint(round(right * grid.width()), round(down * grid.height())))
        run(1.0)
        recording.take(900)
    at = grid.mapFrom(window, recording.mouse)
    QTest.mouseClick(grid, Qt.MouseButton.LeftButton, pos=at)
    run(1.0)
    QTest.keyClick(window, Qt.Key.Key_B)
    recording.rest(2000, 10.0)


def _eased(part):
    return part * part * (3 - 2 * part)


def main(arguments=None):
    """Record the picture into a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("tfscope.webp"))
    asked = parser.parse_args(arguments)
    with windows_here():
        window = opened_window(SCAN, SIZE)
        recording = Recording(window)
        play(recording)
        recording.save(asked.out)
        close_window(window)


if __name__ == "__main__":
    main()
