"""A working day at the window in an hour: real engines, real volumes, memory and times.

``python -m tests.app.soak --minutes 60 [FILE.nrrd ...]`` prints a line per round: resident memory,
open files and threads at rest, always in the same state, and how long frames and events took.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import numpy as np
from PySide6.QtCore import QCoreApplication, QEvent, QEventLoop, QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from app.window.main_window import MainWindow
from app.window.picture_dialog import PictureChoice
from model.scene.crop import CropBox
from model.scene.region import Outline
from model.scene.view import View
from tests.app.process_size import open_handles, resident_mb

RESOURCES = Path(__file__).parents[2] / "resources"
SHIPPED = (
    (
        RESOURCES / "volumes/reacting_jet_temperature_112x112x192_float32.nrrd",
        RESOURCES / "models/reacting_jet_paper",
    ),
    (
        RESOURCES / "volumes/lidc_chest_256x256x133_uint8.nrrd",
        RESOURCES / "models/lidc_chest_paper",
    ),
)
DRAG_STEPS = 60
MOUSE_S = 0.016
PATIENCE_S = 120.0


@dataclass
class Round:
    """Times and problems of one round.

    Attributes
    ----------
    frame_s : list of float
        Times between the images of the reference while something is dragged.
    event_s : list of float
        Times for which the window did not answer: turns of its event loop.
    problems : list of str
        Errors shown, and waits that did not end.
    """

    frame_s: list[float] = field(default_factory=list)
    event_s: list[float] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


class Soak:
    """Uses a window as a user would, a round at a time."""

    def __init__(self, window: MainWindow, folder: Path) -> None:
        self.window = window
        self.folder = folder
        self.round = Round()
        self._last_frame = 0.0
        window.reference.imageShown.connect(self._frame)
        for source in (window.workspace, window.opening, window.pictures, window.browser):
            source.problem.connect(lambda text: self.round.problems.append(text))

    def play(self, volume: Path, model: Path | None) -> None:
        """Open a volume, with its model if there is one, and use everything once."""
        window = self.window
        window.workspace.open_model(None)
        window.workspace.reading.open(volume)
        self.settle()
        if model is not None:
            window.workspace.open_model(model)
            self.settle()
        for use in (
            self.turn,
            self.edit,
            self.region,
            self.hover,
            self.light,
            self.crop,
            self.resize,
            self.browse,
            self.save,
            self.undo,
        ):
            use()
            self.settle()

    def turn(self) -> None:
        """Turn, roll and pan with the mouse on the image, and go back."""
        canvas = self.window.reference.canvas
        for button, keys in (
            (Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier),
            (Qt.MouseButton.RightButton, Qt.KeyboardModifier.NoModifier),
            (Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ShiftModifier),
        ):
            with self._dragged(canvas, button, keys) as move:
                for step in range(DRAG_STEPS):
                    move(step / DRAG_STEPS)
        self.window.state.set_view(View(azimuth=30.0, elevation=15.0))

    def edit(self) -> None:
        """Drag a mode through the range, and leave it there."""
        state = self.window.state
        first = state.transfer_function
        low, high = first.scalar_range
        for step in range(DRAG_STEPS):
            share = 0.2 + 0.5 * step / DRAG_STEPS
            modes = first.opacity.modes
            if not modes:
                break
            moved = replace(modes[0], mean=low + share * (high - low))
            state.tf_input.move(
                replace(first, opacity=replace(first.opacity, modes=(moved, *modes[1:])))
            )
            self._pass(MOUSE_S)
        state.tf_input.finish("drag")

    def region(self) -> None:
        """Draw a region, drag it about, and remove it."""
        asked = self.window.sensitivity_state
        asked.add_region(Outline.rectangle(0.2, 0.3, 0.5, 0.6))
        start = asked.outline
        for step in range(DRAG_STEPS):
            asked.change_region(start.moved(0.3 * step / DRAG_STEPS, 0.0))
            self._pass(MOUSE_S)
        asked.finish_region()
        self.settle()
        asked.remove_region()

    def hover(self) -> None:
        """Move over the TF, pin a value, turn with it, and let it go."""
        asked, state = self.window.sensitivity_state, self.window.state
        low, high = state.transfer_function.scalar_range
        for step in range(DRAG_STEPS):
            asked.hover(low + (high - low) * step / DRAG_STEPS)
            self._pass(MOUSE_S)
        asked.pin((low + high) / 2)
        self.turn()
        self.settle()
        asked.unpin()
        asked.hover(None)

    def light(self) -> None:
        """Light the volume, drag the light, and put it out."""
        work, state = self.window.workspace.reference, self.window.state
        work.choose(lighting="direct")
        self.settle()
        if state.light is not None:
            with self._dragged(
                self.window.reference.canvas,
                Qt.MouseButton.LeftButton,
                Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier,
            ) as move:
                for step in range(DRAG_STEPS):
                    move(step / DRAG_STEPS)
        work.choose(lighting="auto")

    def crop(self) -> None:
        """Cut the volume, and show it whole again."""
        state = self.window.state
        for step in range(DRAG_STEPS):
            state.crop_input.move(CropBox((0.5 * step / DRAG_STEPS, 0.0, 0.0), (1.0, 1.0, 1.0)))
            self._pass(MOUSE_S)
        state.crop_input.finish()
        self.settle()
        state.crop_input.set(None)

    def resize(self) -> None:
        """Make the window larger, and as it was."""
        size = self.window.size()
        for width, height in ((1500, 950), (size.width(), size.height())):
            self.window.resize(width, height)
            self.settle()

    def browse(self) -> None:
        """Show the map of TFs, move over it, drag the rectangle, and hide it."""
        latent = self.window.latent_state
        latent.choose(shown=True)
        self.settle()
        self._pass(2.0)
        for step in range(DRAG_STEPS):
            latent.set_hover((step / DRAG_STEPS - 0.5, 0.2))
            self._pass(MOUSE_S)
        latent.set_hover(None)
        for step in range(DRAG_STEPS):
            share = step / DRAG_STEPS
            latent.move_brush((-0.8, -0.8, 0.8 - share / 2, 0.8 - share / 3))
            self._pass(MOUSE_S)
        latent.finish_brush()
        self._pass(2.0)
        latent.choose(shown=False)

    def save(self) -> None:
        """Save a picture."""
        pictures, place = self.window.pictures, self.folder / "picture.png"
        pictures.draw(PictureChoice(600, 500, None, True), place)
        if not self._until(place.is_file):
            self.round.problems.append("no picture was saved")
        place.unlink(missing_ok=True)

    def undo(self) -> None:
        """Undo everything, and go home."""
        state = self.window.state
        while state.edits.stack.canUndo():
            state.edits.undo()
        state.reset_view()

    def settle(self) -> None:
        """Wait for the images, and note the errors that are shown."""
        self._pass(0.3)
        if not self._until(lambda: self.window.workspace.is_settled):
            self.round.problems.append("it did not settle")
        self.round.problems += self.window.errors

    def rest(self) -> None:
        """Have everything that is no longer used be given back."""
        QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        gc.collect()
        self._pass(0.5)

    def _dragged(self, widget: QWidget, button: Any, keys: Any) -> Any:
        return _Drag(self, widget, button, keys)

    def _frame(self, _inputs: object, _image: object) -> None:
        now = time.perf_counter()
        if self.window.state.live:
            self.round.frame_s.append(now - self._last_frame)
        self._last_frame = now

    def _until(self, true: Callable[[], bool]) -> bool:
        end = time.perf_counter() + PATIENCE_S
        while not true() and time.perf_counter() < end:
            self._pass(0.01)
        return true()

    def _pass(self, seconds: float) -> None:
        end = time.perf_counter() + seconds
        while True:
            start = time.perf_counter()
            QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 5)
            self.round.event_s.append(time.perf_counter() - start)
            if time.perf_counter() >= end:
                return
            time.sleep(0.001)


class _Drag:
    """A drag from a widget's left to its right."""

    def __init__(self, soak: Soak, widget: QWidget, button: Any, keys: Any) -> None:
        self._soak, self._widget, self._button, self._keys = soak, widget, button, keys

    def __enter__(self) -> Callable[[float], None]:
        QTest.mousePress(self._widget, self._button, self._keys, self._place(0.0))
        # The time before the drag is no frame's.
        self._soak._last_frame = time.perf_counter()
        return self._move

    def __exit__(self, *_: object) -> None:
        QTest.mouseRelease(self._widget, self._button, self._keys, self._place(1.0))

    def _place(self, share: float) -> QPoint:
        width, height = self._widget.width(), self._widget.height()
        return QPoint(round(width * (0.3 + 0.4 * share)), round(height * (0.4 + 0.1 * share)))

    def _move(self, share: float) -> None:
        from PySide6.QtCore import QPointF
        from PySide6.QtGui import QMouseEvent

        place = QPointF(self._place(share))
        event = QMouseEvent(
            QEvent.Type.MouseMove,
            place,
            QPointF(self._widget.mapToGlobal(place.toPoint())),
            Qt.MouseButton.NoButton,
            self._button,
            self._keys,
        )
        QCoreApplication.sendEvent(self._widget, event)
        self._soak._pass(MOUSE_S)


def soaked(
    minutes: float, files: list[Path], say: Callable[[str], None] = print
) -> Iterator[tuple[float, int, int, Round]]:
    """Use a window for a time; yield memory in MB, handles, threads and the round, at each rest."""
    QApplication.instance() or QApplication([])
    # As app/launch.py does: Qt's objects must not be collected in an engine's thread.
    gc.disable()
    window = MainWindow()
    with tempfile.TemporaryDirectory() as folder:
        soak = Soak(window, Path(folder))
        try:
            window.show()
            end = time.monotonic() + 60 * minutes
            rounds = 0
            while rounds == 0 or time.monotonic() < end:
                soak.round = Round()
                for volume, model in (*((f, None) for f in files), *SHIPPED):
                    soak.play(volume, model)
                    gc.collect()
                soak.rest()
                rounds += 1
                yield resident_mb(), open_handles(), threading.active_count(), soak.round
        finally:
            window.close()
            window.deleteLater()
            gc.enable()


def main() -> int:
    """Run the job; return 1 if anything was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.app.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("files", nargs="*", type=Path, help="volumes beside the shipped ones")
    asked = parser.parse_args()
    start = time.monotonic()
    frames: list[float] = []
    events: list[float] = []
    memory: list[float] = []
    problems: list[str] = []
    for rss, files, threads, done in soaked(asked.minutes, asked.files):
        frames += done.frame_s
        events += done.event_s
        memory.append(rss)
        problems += done.problems
        print(
            f"{(time.monotonic() - start) / 60:5.1f} min  {rss:6.0f} MB  {files} handles  "
            f"{threads} threads  frames {_times(done.frame_s)}  events {_times(done.event_s)}  "
            f"{len(done.problems)} problems",
            flush=True,
        )
    print(f"all: frames {_times(frames)}; the window does not answer for {_times(events)}")
    half = memory[len(memory) // 2 :]
    print(f"memory of the later half: {min(half):.0f} to {max(half):.0f} MB")
    for problem in dict.fromkeys(problems):
        print(" ", problem)
    return min(len(problems), 1)


def _times(seconds: list[float]) -> str:
    ms = 1000 * np.array(seconds or [0.0])
    return f"{np.median(ms):.0f}/{np.percentile(ms, 99):.0f}/{ms.max():.0f} ms"


if __name__ == "__main__":
    sys.exit(main())
