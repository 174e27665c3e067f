"""Pictures a second that the real window shows while something is dragged, and those at rest.

The window's renderer then draws the same pictures alone, as often as it did in the drag.
"""

from __future__ import annotations

import argparse
import itertools
import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, get_args
from unittest.mock import patch

from PySide6.QtCore import QEvent, QEventLoop, QObject, QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from app.engines.messages import Result
from app.launch import garbage_collected_here
from app.state.preferences import Preferences
from app.theme import apply_theme
from app.window.main_window import MainWindow
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import Lighting
from tests.benchmarks.rows import paths, print_machine, print_rows, timed

WINDOW = 1440, 860
STEP_MS = 12
"""Time between two moves of the mouse."""

PATIENCE_S, QUIET_S = 120.0, 1.0
"""Longest wait for a picture at rest, and how long that rests before a drag."""

HEADING = (
    *("light", "shown/s", "renderer/s", "ratio", "width", "first, ms", "longest gap, ms"),
    *("GUI, cores", "oldest change, ms", "sharp, s", "last, s"),
)


class Watched(QObject):
    """Notes when the window paints a new picture, and how old are its sensitivities."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self._window, self._new = window, 0
        self.begin()
        answers = window.workspace.sensitivity
        answers.answered.connect(self._take_answer)
        window.state.inputsChanged.connect(self._note_state)
        window.reference.resultShown.connect(self._note_picture)
        window.reference.canvas.installEventFilter(self)

    def begin(self) -> None:
        now = time.perf_counter()
        self.painted: list[tuple[float, int]] = []
        self.oldest = 0.0
        self._states: list[tuple[SceneInputs, float]] = [(self._window.state.inputs, now)]
        asked = self._window.sensitivity_state
        shown = {"curve": asked.shows_curve, "area": asked.choices.shown}
        self._born = {name: now for name, is_shown in shown.items() if is_shown}

    def look(self) -> None:
        ages = (time.perf_counter() - born for born in self._born.values())
        self.oldest = max([self.oldest, *ages])

    def eventFilter(self, _canvas: QObject, event: QEvent) -> bool:  # noqa: N802
        if event.type() == QEvent.Type.Paint and self._new:
            self.painted.append((time.perf_counter(), self._new))
            self._new = 0
        return False

    def _note_picture(self, result: Result) -> None:
        self._new = 0 if result.value is None else result.value.shape[1]

    def _note_state(self) -> None:
        self._states.append((self._window.state.inputs, time.perf_counter()))

    def _take_answer(self, what: str) -> None:
        answers = self._window.workspace.sensitivity
        if what == "region":
            self._take("curve", answers.region)
        elif what == "visibility":
            self._take("area", answers.visibility)

    def _take(self, name: str, answer: Any) -> None:
        self.look()
        if answer is not None and name in self._born:
            inputs = answer.request.inputs
            found = (born for state, born in reversed(self._states) if state == inputs)
            self._born[name] = next(found, self._born[name])


@contextmanager
def recorded(drawn: list[tuple[int, Callable[[], Any]]]) -> Iterator[None]:
    """Note each picture that is drawn meanwhile, by its width and how to draw it again."""

    def noting(draw: Callable[..., Any]) -> Callable[..., Any]:
        def noted(renderer: Any, inputs: SceneInputs, size: Any, *others: Any, **named: Any) -> Any:
            drawn.append((Raster.of(size).width, partial(draw, renderer, inputs, size, *others)))
            return draw(renderer, inputs, size, *others, **named)

        return noted

    with ExitStack() as patches:
        for cls, name in ((RaycastRenderer, "render"), (RefiningRenderer, "moving")):
            patches.enter_context(patch.object(cls, name, noting(getattr(cls, name))))
        yield


def run(seconds: float, step: Callable[[], object] = lambda: None) -> None:
    """Let the window work for some seconds, or until a step returns True."""
    loop, timer, ends = QEventLoop(), QTimer(interval=STEP_MS), time.monotonic() + seconds
    timer.timeout.connect(lambda: (step() is True or time.monotonic() > ends) and loop.quit())
    timer.start()
    loop.exec()
    timer.stop()


def opened_window(path: Path) -> MainWindow:
    """Return a window that remembers nothing, in which a volume is being opened."""
    window = MainWindow(preferences=Preferences())
    window.resize(*WINDOW)
    window.show()
    window.workspace.opening.open(path)
    return window


def close_window(window: MainWindow) -> None:
    """Close a window, and end its timers."""
    window.close()
    window.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@contextmanager
def windows_here() -> Iterator[None]:
    """Have an application, off screen where there is no display."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    application = QApplication.instance() or QApplication([])
    assert isinstance(application, QApplication)
    apply_theme(application)
    with garbage_collected_here():
        yield


def grip(window: MainWindow, what: str) -> tuple[QWidget, QPoint, QPoint]:
    """Return what is dragged: the widget, where it is grasped, and how far it is moved."""
    if what == "view":
        canvas = window.reference.canvas
        return canvas, canvas.rect().center(), QPoint(canvas.width() // 3, 12)
    area = window.editor.area
    plot = area.widget.viewport()
    # One in the middle: at the border it would rest while the mouse goes on.
    inner = [box.center() - plot.rect().center() for box in area.handle_boxes()]
    nearest = min(inner, key=lambda place: place.manhattanLength())
    return plot, plot.rect().center() + nearest, QPoint(40, 30)


def measured(path: Path, lighting: Lighting, asked: argparse.Namespace) -> tuple[object, ...]:
    """Drag in the window, and then have its renderer draw the same."""
    window = opened_window(path)
    window.sensitivity_state.choose(shown=not asked.hidden)
    watched = Watched(window)
    window.workspace.reference.choose(lighting=lighting)
    answers = window.workspace.sensitivity
    run(
        PATIENCE_S,
        lambda: (
            bool(watched.painted)
            and window.workspace.is_settled
            and (asked.hidden or answers.visibility is not None)
        ),
    )
    run(QUIET_S)
    drawn: list[tuple[int, Callable[[], Any]]] = []
    widget, start, reach = grip(window, asked.drag)
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, pos=start)
    watched.begin()
    begun, cpu = time.perf_counter(), time.thread_time()

    def move() -> None:
        passed = time.perf_counter() - begun
        right, down = reach.x() * math.sin(2 * passed), reach.y() * math.sin(3 * passed)
        QTest.mouseMove(widget, start + QPoint(round(right), round(down)))
        watched.look()

    with recorded(drawn):
        run(asked.seconds, move)
    cpu, ended = time.thread_time() - cpu, time.perf_counter()
    painted, oldest = list(watched.painted), watched.oldest
    watched.begin()
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, pos=start)
    run(PATIENCE_S, lambda: bool(watched.painted) and window.workspace.is_settled)
    last = time.perf_counter() - ended
    whole = max((width for _, width in watched.painted), default=0)
    sharp = next((at - ended for at, width in watched.painted if width == whole), None)
    run(QUIET_S)
    widths = [width for _, width in painted]
    again = [draw for width, draw in drawn if width in widths]
    _, took = timed(lambda: [draw() for draw in again])
    close_window(window)
    shown, alone = len(painted) / (ended - begun), len(again) / took
    times = [begun, *(at for at, _ in painted), ended]
    gaps = [later - earlier for earlier, later in itertools.pairwise(times)]
    return (
        *(lighting, shown, alone, shown / alone if alone else None),
        *(round(median(widths)) if widths else None, 1e3 * gaps[0], 1e3 * max(gaps)),
        *(cpu / (ended - begun), 1e3 * oldest, sharp, last),
    )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--volume", type=Path, action="append", help="may be repeated")
    parser.add_argument("--lighting", action="append", choices=get_args(Lighting))
    parser.add_argument("--drag", choices=("view", "handle"), default="view")
    parser.add_argument("--seconds", type=float, default=5.0, help="of a drag")
    parser.add_argument("--hidden", action="store_true", help="without sensitivities")
    asked = parser.parse_args(arguments)
    print_machine()
    with windows_here():
        for path in paths(asked):
            rows = [measured(path, name, asked) for name in asked.lighting or get_args(Lighting)]
            print_rows(f"{path.name}, {asked.drag} dragged", HEADING, rows)


if __name__ == "__main__":
    main()
