"""A moving picture of the window for the README, from a script of mouse and keys at the real one.

``python -m tests.benchmarks.moving_picture --out resources/tfscope.webp``; some minutes, in which
waits for images are left out.
"""

from __future__ import annotations

import argparse
import gc
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from PIL import Image
from PySide6.QtCore import QCoreApplication, QEvent, QEventLoop, QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPolygonF
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from app.launch import garbage_collected_here
from app.state.latent_pictures import HOVER_SIZE
from app.theme import apply_theme
from app.window.main_window import MainWindow
from model.volume_files.shipped import SCAN

SIZE = 960, 640
STEP_MS = 80
"""Time that a picture is shown while something moves."""

LONGEST = 4e5
"""Bytes of the file."""

MOVING_S, TURNED_S, RESTING_S = 1.0, 20.0, 60.0
"""Longest waits for images of a drag, of one step of a turn, and at rest."""

ARROW = QPolygonF(
    [QPointF(*at) for at in ((0, 0), (0, 17), (4, 13), (7, 19), (10, 18), (7, 12), (12, 12))]
)


class Recording:
    """A window, the mouse over it, and the pictures so far with their times."""

    def __init__(self, window: MainWindow) -> None:
        self.window = window
        self.pictures: list[Image.Image] = []
        self.times: list[int] = []
        self._mouse = QPoint(window.width() // 2, window.height() // 2)

    def wait(self, until: Callable[[], bool], seconds: float) -> None:
        """Let the window work until something holds, and what it asked for has been painted."""
        end = time.monotonic() + seconds
        while not until() and time.monotonic() < end:
            QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 5)
            time.sleep(0.002)
        QCoreApplication.processEvents()

    def rest(self, shown_ms: int, seconds: float = 0.0) -> None:
        """Take a picture of the window at rest, after some more time for its questions."""
        self.wait(lambda: False, 0.5)
        self.wait(lambda: self.window.workspace.is_settled, RESTING_S)
        self.wait(lambda: False, seconds)
        self.take(shown_ms)

    def take(self, shown_ms: int = STEP_MS) -> None:
        """Take a picture, with the mouse in it."""
        picture = self.window.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.translate(self._mouse)
        painter.setPen(QColor("black"))
        painter.setBrush(QColor("white"))
        painter.drawPolygon(ARROW)
        painter.end()
        rows = np.frombuffer(picture.constBits(), np.uint8).reshape(picture.height(), -1)
        pixels = rows[:, : 3 * picture.width()].reshape(picture.height(), picture.width(), 3)
        self.pictures.append(Image.fromarray(pixels.copy()))
        self.times.append(shown_ms)

    def go(self, widget: QWidget, at: QPoint, steps: int = 3) -> None:
        """Move the mouse to a place of a widget, without a button."""
        start, end = self._mouse, widget.mapTo(self.window, at)
        for step in range(1, steps + 1):
            self._mouse = start + (end - start) * _eased(step / steps)
            self._send(widget, QEvent.Type.MouseMove, Qt.MouseButton.NoButton)
            self.wait(lambda: False, 0.05)
            self.take()

    def drag(self, widget: QWidget, points: Sequence[QPoint], seconds: float = 0.02) -> None:
        """Drag with the left button from the first place over the others, with time for each."""
        left = Qt.MouseButton.LeftButton
        self._mouse = widget.mapTo(self.window, points[0])
        self._send(widget, QEvent.Type.MouseButtonPress, left)
        for point in points[1:]:
            self._mouse = widget.mapTo(self.window, point)
            self._send(widget, QEvent.Type.MouseMove, left)
            self.wait(lambda: False, seconds)
            self.take()
        self._send(widget, QEvent.Type.MouseButtonRelease, left)

    def turn(self, view: QWidget, keys: Sequence[Qt.Key]) -> None:
        """Turn the volume by keys, with time for both images to be refined after each."""
        for key in keys:
            QTest.keyClick(view, key)
            self.wait(lambda: False, 0.3)
            self.wait(lambda: self.window.workspace.is_settled, TURNED_S)
            self.take(2 * STEP_MS)

    def press(self, key: Qt.Key) -> None:
        """Press a key of the window."""
        QTest.keyClick(self.window, key)

    def save(self, path: Path) -> None:
        """Write all pictures, at the best quality that is not too long."""
        first, others = self.pictures[0], self.pictures[1:]
        for quality in range(60, 10, -10):
            first.save(
                path,
                save_all=True,
                append_images=others,
                duration=self.times,
                loop=0,
                quality=quality,
                method=6,
                minimize_size=True,
            )
            size = path.stat().st_size
            print(f"{path}: {len(self.pictures)} pictures, quality {quality}, {size:,} bytes")
            if size <= LONGEST:
                return

    def _send(self, widget: QWidget, kind: QEvent.Type, button: Qt.MouseButton) -> None:
        place = QPointF(widget.mapFrom(self.window, self._mouse))
        moves, none = kind == QEvent.Type.MouseMove, Qt.MouseButton.NoButton
        held = none if kind == QEvent.Type.MouseButtonRelease else button
        far = QPointF(widget.mapToGlobal(place))
        keys = Qt.KeyboardModifier.NoModifier
        event = QMouseEvent(kind, place, far, none if moves else button, held, keys)
        QCoreApplication.sendEvent(widget, event)


def play(recording: Recording) -> None:
    """Turn the volume, ask about a region, edit the TF, and take another one off the map."""
    window = recording.window
    canvas, plot = window.generator.canvas, window.editor.area.widget.viewport()

    def on(right: float, down: float) -> QPoint:
        return QPoint(round(right * canvas.width()), round(down * canvas.height()))

    recording.wait(lambda: window.workspace.is_settled, 3 * RESTING_S)
    recording.rest(1500, 4.0)
    recording.go(canvas, on(0.5, 0.6))
    right, left = Qt.Key.Key_Right, Qt.Key.Key_Left
    recording.turn(canvas, [*4 * [right], *4 * [left]])
    recording.rest(700)
    # Region and curve.
    recording.press(Qt.Key.Key_R)
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
    # The map.
    QTest.keyClick(window, Qt.Key.Key_Delete, Qt.KeyboardModifier.ShiftModifier)
    recording.press(Qt.Key.Key_B)
    recording.rest(1200, 12.0)
    latent = window.browser.map
    for right, down in ((0.45, 0.4), (0.6, 0.75), (0.7, 0.78)):
        recording.go(latent, QPoint(round(right * latent.width()), round(down * latent.height())))
        recording.wait(lambda: False, 1.0)
        recording.wait(lambda: _is_sharp(window), TURNED_S)
        recording.take(900)
    at = recording._mouse
    QTest.mouseClick(latent, Qt.MouseButton.LeftButton, pos=latent.mapFrom(window, at))
    recording.wait(lambda: False, 1.0)
    recording.press(Qt.Key.Key_B)
    recording.rest(2000, 10.0)


def _is_sharp(window: MainWindow) -> bool:
    """Whether the picture under the mouse has all of its pixels."""
    hover = window.workspace.latent.hover
    return hover is not None and len(hover.image) >= HOVER_SIZE


def _eased(part: float) -> float:
    return part * part * (3 - 2 * part)


def main(arguments: Sequence[str] | None = None) -> None:
    """Record the picture into a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("tfscope.webp"))
    parser.add_argument("--frames", type=Path, help="folder for each picture by itself")
    asked = parser.parse_args(arguments)
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    gc.disable()
    application = QApplication([])
    apply_theme(application)
    window = MainWindow()
    window.resize(*SIZE)
    window.workspace.opening.open(SCAN)
    window.show()
    recording = Recording(window)
    with garbage_collected_here():
        play(recording)
    recording.save(asked.out)
    if asked.frames is not None:
        asked.frames.mkdir(parents=True, exist_ok=True)
        for number, picture in enumerate(recording.pictures):
            picture.save(asked.frames / f"{number:03}.png")
    window.close()


if __name__ == "__main__":
    main()
