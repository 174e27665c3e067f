"""Pictures a second that the real window shows while something is dragged, and those at rest.

The window's renderer then draws the same pictures alone, as often as it did in the drag. With
`--burners`, so many other processes keep the processors busy.
"""

import math
import os
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from functools import partial
from statistics import median
from typing import get_args
from unittest.mock import patch

from PySide6.QtCore import QEvent, QEventLoop, QObject, QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.launch import garbage_collected_here
from app.state.preferences import Preferences
from app.theme import apply_theme
from app.window.main_window import MainWindow
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.scene import Lighting
from tests.benchmarks.rows import options, parsed, paths, print_rows, timed

WINDOW = 1440, 860
STEP_MS = 12  # time between two moves of the mouse

PATIENCE_S, QUIET_S = 120.0, 1.0
"""Longest wait for a picture at rest, and how long that rests before a drag."""

HEADING = (
    *("light", "shown/s", "renderer's share", "width", "first, ms", "GUI, cores"),
    *("oldest picture, ms", "oldest change, ms", "sharp, s", "last, s"),
)


class Watched(QObject):
    """Notes when the window paints a new picture, and how old it and its sensitivities become."""

    def __init__(self, window):
        super().__init__(window)
        self._window, self._new = window, 0
        self.begin()
        window.workspace.sensitivity.answered.connect(self._take_answer)
        window.state.inputsChanged.connect(self._note_state)
        window.reference.resultShown.connect(self._note_picture)
        window.reference.canvas.installEventFilter(self)

    def begin(self):
        now = time.perf_counter()
        self.painted, self.oldest, self.oldest_picture = [], 0.0, 0.0
        self._states, self._shown = [(self._window.state.inputs, now)], now
        asked = self._window.sensitivity_state
        shown = {"region": asked.shows_curve, "visibility": asked.choices.shown}
        self._born = {what: now for what, is_shown in shown.items() if is_shown}

    def look(self):
        ages = (time.perf_counter() - born for born in self._born.values())
        self.oldest = max([self.oldest, *ages])

    def eventFilter(self, _canvas, event):  # noqa: N802
        if event.type() == QEvent.Type.Paint and self._new:
            self.look_at_picture()
            self.painted.append((time.perf_counter(), self._new))
            self._new, self._shown = 0, self._coming
        return False

    def look_at_picture(self):
        self.oldest_picture = max(self.oldest_picture, time.perf_counter() - self._shown)

    def _note_picture(self, result):
        self._new = 0 if result.value is None else result.value.shape[1]
        self._coming = self._birth(result, self._shown)

    def _birth(self, result, otherwise):
        """When the state that an answer is of began."""
        inputs = result.request.inputs
        found = (born for state, born in reversed(self._states) if state == inputs)
        return next(found, otherwise)

    def _note_state(self):
        self._states.append((self._window.state.inputs, time.perf_counter()))

    def _take_answer(self, what):
        self.look()
        answer = getattr(self._window.workspace.sensitivity, what) if what in self._born else None
        if answer is not None:
            self._born[what] = self._birth(answer, self._born[what])


@contextmanager
def recorded(drawn):
    """Note each picture that is drawn meanwhile, by its width and how to draw it again."""

    def noting(draw):
        def noted(renderer, inputs, size, *others, **named):
            drawn.append((Raster.of(size).width, partial(draw, renderer, inputs, size, *others)))
            return draw(renderer, inputs, size, *others, **named)

        return noted

    with ExitStack() as patches:
        for cls, name in ((RaycastRenderer, "render"), (RefiningRenderer, "moving")):
            patches.enter_context(patch.object(cls, name, noting(getattr(cls, name))))
        yield


@contextmanager
def burners(count):
    """Keep the processors busy meanwhile by other processes."""
    command = [sys.executable, "-c", "while True: pass"]
    burning = [subprocess.Popen(command) for _ in range(count)]
    try:
        yield
    finally:
        for process in burning:
            process.kill()
            process.wait()


def run(seconds, step=lambda: None):
    """Let the window work for some seconds, or until a step returns True."""
    loop, timer, ends = QEventLoop(), QTimer(interval=STEP_MS), time.monotonic() + seconds
    timer.timeout.connect(lambda: (step() is True or time.monotonic() > ends) and loop.quit())
    timer.start()
    loop.exec()
    timer.stop()


def opened_window(path, size=WINDOW):
    """A window that remembers nothing, in which a volume is being opened."""
    window = MainWindow(preferences=Preferences())
    window.resize(*size)
    window.show()
    window.workspace.opening.open(path)
    return window


def close_window(window):
    """Close a window, and end its timers."""
    window.close()
    window.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@contextmanager
def windows_here():
    """Have an application, off screen unless the environment says otherwise."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ.setdefault("QT_LOGGING_RULES", "default.warning=false")
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    application = QApplication.instance() or QApplication([])
    apply_theme(application)
    with garbage_collected_here():
        yield


def grip(window, what):
    """Return the widget that is dragged, where it is grasped, and how far it is moved."""
    if what == "view":
        canvas = window.reference.canvas
        return canvas, canvas.rect().center(), QPoint(canvas.width() // 3, 12)
    area = window.editor.area
    plot = area.widget.viewport()
    # One in the middle: at the border it would rest while the mouse goes on.
    inner = [box.center() - plot.rect().center() for box in area.handle_boxes()]
    nearest = min(inner, key=lambda place: place.manhattanLength())
    return plot, plot.rect().center() + nearest, QPoint(40, 30)


def measured(path, lighting, asked):
    """Drag in the window, and then have its renderer draw the same."""
    window = opened_window(path)
    window.sensitivity_state.choose(shown=True)
    watched = Watched(window)
    work = window.workspace
    work.reference.choose(lighting=lighting)

    def is_drawn():
        return bool(watched.painted) and work.is_settled

    run(PATIENCE_S, lambda: is_drawn() and work.sensitivity.visibility is not None)
    drawn = []
    widget, start, reach = grip(window, asked.drag)

    def move():
        passed = time.perf_counter() - begun
        right, down = reach.x() * math.sin(2 * passed), reach.y() * math.sin(3 * passed)
        QTest.mouseMove(widget, start + QPoint(round(right), round(down)))
        watched.look()

    with recorded(drawn), burners(asked.burners):
        # Other processes have started by then.
        run(QUIET_S)
        QTest.mousePress(widget, Qt.MouseButton.LeftButton, pos=start)
        watched.begin()
        begun, cpu = time.perf_counter(), time.thread_time()
        run(asked.seconds, move)
        watched.look_at_picture()
    cpu, ended = time.thread_time() - cpu, time.perf_counter()
    painted, oldest, oldest_picture = watched.painted, watched.oldest, watched.oldest_picture
    watched.begin()
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, pos=start)
    run(PATIENCE_S, is_drawn)
    last = time.perf_counter() - ended
    whole = max((width for _, width in watched.painted), default=0)
    sharp = next((at - ended for at, width in watched.painted if width == whole), None)
    run(QUIET_S)
    widths = [width for _, width in painted]
    again = [draw for width, draw in drawn if width in widths]
    _, took = timed(lambda: [draw() for draw in again])
    close_window(window)
    passed, middle = ended - begun, round(median(widths)) if widths else None
    share = len(painted) / passed * took / len(again) if again else None
    first = 1e3 * ((painted[0][0] if painted else ended) - begun)
    return (
        *(lighting, len(painted) / passed, share, middle, first),
        *(cpu / passed, 1e3 * oldest_picture, 1e3 * oldest, sharp, last),
    )


def main(arguments=None):
    parser = options(__doc__, seconds=5.0, burners=0)
    parser.add_argument("--lighting", action="append", choices=get_args(Lighting))
    parser.add_argument("--drag", choices=("view", "handle"), default="view")
    asked = parsed(parser, arguments)
    with windows_here():
        for path in paths(asked):
            rows = [measured(path, name, asked) for name in asked.lighting or get_args(Lighting)]
            print_rows(f"{path.name}, {asked.drag} dragged", HEADING, rows)


if __name__ == "__main__":
    main()
