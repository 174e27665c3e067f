"""A monkey at the window: random events, and engines that raise, hang and die at random.

``QT_QPA_PLATFORM=offscreen PYTHONPATH=tests/app:tests:. python -m tests.app.monkey --events 5000``;
:mod:`test_launch` has a short run.
"""

import argparse
import gc
import random
import re
import sys
import threading
import time
import traceback
from dataclasses import replace
from functools import partial
from pathlib import Path

from mouse_events import wheel
from PySide6.QtCore import QCoreApplication, QEvent, QEventLoop, QPoint, QPointF, Qt, QTimer
from PySide6.QtGui import QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QDialog,
    QFileDialog,
    QInputDialog,
    QMenu,
    QMessageBox,
    QWidget,
)
from ramp import make_volume
from window_fakes import FakeBuilders, FakeEngine

from app.engines.requests import UNWATCHED
from app.engines.worker import THREAD_PREFIX
from app.window.main_window import MainWindow
from model.errors import RenderError

KEYS = "RLSWFGTPVMCKXYZ123456789[]+-"
SPECIAL = [
    Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Delete,
    Qt.Key.Key_Escape, Qt.Key.Key_Return, Qt.Key.Key_Tab, Qt.Key.Key_Home, Qt.Key.Key_Space,
]  # fmt: skip
BUTTONS = [Qt.MouseButton.LeftButton] * 4 + [Qt.MouseButton.MiddleButton]
NONE, SHIFT = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier
MODIFIERS = [NONE] * 3 + [SHIFT, Qt.KeyboardModifier.ControlModifier]
SETTLE_S = 20.0
SKIPPED = re.compile(r"quit|close|train|export\.\.\.", re.IGNORECASE)


class UnreliableEngine(FakeEngine):
    """Raises errors of its own and of others, hangs for a while and dies, all at random."""

    rng = random.Random(0)
    calm = False

    def images(self, request, watch=UNWATCHED):
        self._wait_or_fail()
        return super().images(request, watch)

    def visibility(self, request, watch=UNWATCHED):
        self._wait_or_fail()
        return super().visibility(request)

    def _wait_or_fail(self):
        if self.calm:
            return
        errors = RenderError("Try again."), KeyError("a defect"), MemoryError(), SystemExit("dies")
        if self.rng.random() < 0.1:
            raise self.rng.choice(errors)
        if self.rng.random() < 0.06:
            time.sleep(0.2 * self.rng.random())


class UnreliableBuilders(FakeBuilders):
    """Builds such engines, or fails at that."""

    def reference(self, volume, settings):
        return self._engine(None)

    def analyst(self, volume, settings):
        return self._engine(None)

    def generator(self, folder, kept, device="auto"):
        return self._engine(super().generator(folder, kept, device).scene)

    def _engine(self, scene):
        if not UnreliableEngine.calm and UnreliableEngine.rng.random() < 0.1:
            raise RenderError("The engine cannot be built; try again.")
        return UnreliableEngine(scene)


class Monkey:
    """Makes random events in a window, and rests from time to time to look at it."""

    def __init__(self, window, seed):
        self.window = window
        self.rng = random.Random(seed)
        self.errors = []  # exceptions that nobody caught, pictures of another state, no rest
        self.shown = {}
        self.last = ""
        # Menus of buttons wait for an answer in loops of their own.
        closing = QTimer(window, interval=20)
        closing.timeout.connect(close_popup)
        closing.start()
        for name in ("generator", "reference"):
            getattr(window, name).imageShown.connect(partial(self._note, name))

    def _note(self, name, inputs, _image):
        self.shown[name] = inputs

    def play(self, events, rest_every=250):
        """Make events; rest after each so many, and at the end."""
        choices = [self._press] * 6 + [self._drag] * 6 + [self._wheel] * 2 + [self._key] * 5
        choices += [self._act] * 4 + [self._open, self._resize]
        for number in range(1, events + 1):
            event = self.rng.choice(choices)
            self.last = event.__name__
            event()
            self._process(0.004 * self.rng.random())
            if number % rest_every == 0 or number == events:
                self._rest(number)

    def _process(self, seconds):
        end = time.perf_counter() + seconds
        QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 20)
        while time.perf_counter() < end:
            QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 5)

    def _rest(self, number):
        """Ask for new pictures of engines that behave, and compare them with the state."""
        UnreliableEngine.calm = True
        state, workspace = self.window.state, self.window.workspace
        state.finish_view()
        self.window.show()
        self.window.resize(1280, 860)
        self.window.latent_state.choose(shown=False)
        self.shown.clear()
        # Engines that could not be built are built again.
        workspace.opening.open(Path("ramp"))
        end = time.perf_counter() + SETTLE_S
        self._process(0.3)
        while not workspace.is_settled and time.perf_counter() < end:
            self._process(0.02)
        if not workspace.is_settled:
            self.errors.append(f"{number}: it did not settle")
        for name, inputs in self.shown.items():
            pane = getattr(self.window, name)
            if pane.isVisible() and replace(inputs, crop=None) != replace(state.inputs, crop=None):
                self.errors.append(f"{number}: the {name} shows another state")
        QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        gc.collect()
        UnreliableEngine.calm = False

    def _widget(self):
        seen = [w for w in self.window.findChildren(QWidget) if w.isVisible() and w.isEnabled()]
        seen = [w for w in seen if not isinstance(w, QMenu) and w.width() > 1 and w.height() > 1]
        return self.rng.choice(seen) if seen else None

    def _point(self, widget):
        # What is folded meanwhile has no pixels.
        width, height = (max(size, 1) for size in (widget.width(), widget.height()))
        return QPoint(self.rng.randrange(width), self.rng.randrange(height))

    def _press(self):
        widget = self._widget()
        if widget is None or SKIPPED.search(label(widget)):
            return
        click = self.rng.choice([QTest.mouseClick, QTest.mouseClick, QTest.mouseDClick])
        click(widget, self.rng.choice(BUTTONS), self.rng.choice(MODIFIERS), self._point(widget))

    def _drag(self):
        widgets = [self.window.reference.canvas, self.window.generator.canvas, self._widget()]
        widget = self.rng.choice([w for w in widgets if w is not None and w.isVisible()] or [None])
        if widget is None or SKIPPED.search(label(widget)):
            return
        button, modifier = self.rng.choice(BUTTONS), self.rng.choice(MODIFIERS)
        QTest.mousePress(widget, button, modifier, self._point(widget))
        for _ in range(self.rng.randrange(6)):
            QTest.mouseMove(widget, self._point(widget))
            self._process(0.0)
        if self.rng.random() < 0.95:
            QTest.mouseRelease(widget, button, modifier, self._point(widget))

    def _wheel(self):
        if widget := self._widget():
            place, notches = QPointF(self._point(widget)), self.rng.choice([-2, -1, 1, 2])
            wheel(widget, place, notches, keys=self.rng.choice(MODIFIERS))

    def _key(self):
        widget = QApplication.focusWidget() or self.window
        key = self.rng.choice([*KEYS, *SPECIAL])
        modifier = self.rng.choice(MODIFIERS)
        if isinstance(key, str) and modifier == Qt.KeyboardModifier.ControlModifier:
            key = self.rng.choice("ZYKC")
        QTest.keyClick(widget, key, modifier)

    def _act(self):
        found = [a for a in self.window.findChildren(QAction) if a.isEnabled() and not a.menu()]
        self.rng.choice([a for a in found if not SKIPPED.search(a.text())]).trigger()

    def _open(self):
        workspace = self.window.workspace
        if self.rng.random() < 0.6:
            workspace.opening.open(Path(self.rng.choice(["ramp", "other", "missing"])))
        else:
            workspace.open_model(self.rng.choice([None, Path("model"), Path("model2")]))

    def _resize(self):
        self.window.resize(self.rng.randrange(400, 2000), self.rng.randrange(300, 1300))


def label(widget):
    """Text of a button; empty for what has none."""
    text = getattr(widget, "text", None)
    return str(text()) if callable(text) else ""


def close_popup():
    if popup := QApplication.activePopupWidget():
        popup.close()


def monkey_at_work(events, seed):
    """Return what was found, and the names of the threads that are left."""
    QApplication.instance() or QApplication([])
    # Dialogs that wait for an answer are cancelled at once.
    QDialog.exec = QMessageBox.exec = lambda *_: 0
    QMessageBox.question = lambda *_, **__: QMessageBox.StandardButton.No
    for owner, names, answer in (
        (QFileDialog, ("getOpenFileName", "getSaveFileName"), ("", "")),
        (QFileDialog, ("getExistingDirectory",), ""),
        (QInputDialog, ("getText", "getItem", "getDouble", "getInt"), ("", False)),
    ):
        for name in names:
            setattr(owner, name, staticmethod(lambda *_, answer=answer, **__: answer))
    # As app/launch.py does: Qt's objects must not be collected in an engine's thread.
    gc.disable()
    UnreliableEngine.rng = random.Random(seed)
    volumes = {"ramp": make_volume(), "other": make_volume()}
    window = MainWindow(UnreliableBuilders(volumes=volumes).make())
    monkey = Monkey(window, seed)

    def note(kind, error, trace):
        where = traceback.extract_tb(trace)[-1:]
        monkey.errors.append(f"after {monkey.last}: {kind.__name__}: {error}; {where}")

    sys.excepthook = note
    try:
        UnreliableEngine.calm = True
        window.workspace.opening.open(Path("ramp"))
        window.workspace.open_model(Path("model"))
        window.show()
        monkey._process(1.0)
        UnreliableEngine.calm = False
        monkey.play(events)
    finally:
        UnreliableEngine.calm = True
        window.close()
        window.deleteLater()
        monkey._process(0.2)
        QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    names = [thread.name for thread in threading.enumerate()]
    return monkey.errors, [name for name in names if name.startswith(THREAD_PREFIX)]


def main():
    """Run the job; return 1 if anything was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.app.monkey", description=__doc__)
    parser.add_argument("--events", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    errors, threads = monkey_at_work(asked.events, asked.seed)
    print(f"threads left: {threads}; errors: {len(errors)}")
    for error in list(dict.fromkeys(errors))[:20]:
        print(" ", error)
    return min(len(errors) + len(threads), 1)


if __name__ == "__main__":
    raise SystemExit(main())
