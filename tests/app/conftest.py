import gc
import threading
from pathlib import Path

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QThread, QTimer
from PySide6.QtWidgets import QApplication, QMessageBox
from pytestqt.qtbot import QtBot
from ramp import make_tf
from rested_window import open_volume
from shiboken6 import getAllValidWrappers
from window_fakes import PATIENCE_S, FakeBuilders

from app.engines.worker import THREAD_PREFIX
from app.state import image_scheduler
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from app.window.main_window import MainWindow

# A busy machine fails no test.
for wait in (QtBot.waitUntil, QtBot.waitSignal, QtBot.waitSignals, QtBot.waitExposed):
    wait.__kwdefaults__["timeout"] = 1000 * PATIENCE_S


@pytest.fixture(autouse=True, scope="module")
def garbage_of_the_module():
    """Collect windows in reference cycles, without the objects that were there before."""
    gc.freeze()
    yield
    gc.collect()
    gc.unfreeze()


@pytest.fixture(autouse=True)
def garbage_stays_in_this_thread():
    """Collect nothing while threads of engines may run: Qt's objects die in their own thread."""
    gc.disable()
    yield
    gc.enable()


@pytest.fixture(autouse=True)
def nothing_left_alive(request, qapp):
    """Fail a test that leaves a thread, a running timer or a window behind."""
    if "cli" in request.path.parts:
        yield
        return
    before = set(QApplication.topLevelWidgets())
    yield
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    if still_alive(before):
        # Widgets without a parent wait in reference cycles.
        gc.collect()
    assert still_alive(before) == []


def still_alive(before):
    """Worker threads, running timers and Qt threads, and windows that were not there before."""
    alive = [t.name for t in threading.enumerate() if t.name.startswith(THREAD_PREFIX)]
    wrappers = getAllValidWrappers()
    alive += [repr(w) for w in wrappers if isinstance(w, QTimer) and w.isActive()]
    threads = [w for w in wrappers if isinstance(w, QThread) and w.loopLevel()]
    alive += [repr(thread) for thread in threads if thread.isRunning()]
    return alive + [repr(w) for w in set(QApplication.topLevelWidgets()) - before]


@pytest.fixture(autouse=True)
def no_question_waits(monkeypatch):
    """Answer what a window asks when it is closed; in no drag is the mouse held still."""
    monkeypatch.setattr(image_scheduler, "STILL_MS", 10**8)
    monkeypatch.setattr(QMessageBox, "question", lambda *_: QMessageBox.StandardButton.Yes)


@pytest.fixture
def state():
    """A state over 100..200 with modes at 130 and 170."""
    state = ViewerState()
    state.start_volume(make_tf(), None)
    return state


@pytest.fixture
def builders():
    return FakeBuilders()


@pytest.fixture
def make_window(qtbot, builders):
    """Open a window on fake engines and wait until both images are there."""

    def make(volume="ramp", model=Path("model"), folder=None, size="generator", **choices):
        window = MainWindow(builders.make(), preferences=Preferences(folder))
        window.workspace.reference.choose(reference_size=size, **choices)
        qtbot.addWidget(window)
        with qtbot.waitSignal(window.workspace.settled):
            window.workspace.open_model(model)
            window.workspace.opening.open(Path(volume))
        window.show()
        qtbot.waitExposed(window)
        return window

    return make


@pytest.fixture
def window(make_window):
    """A window without a model."""
    return make_window(model=None)


@pytest.fixture
def start_again(qtbot, builders, tmp_path):
    """Open a window as the next run would, on a volume."""

    def start(volume="ramp"):
        window = MainWindow(builders.make(), preferences=Preferences(tmp_path / "kept"))
        qtbot.addWidget(window)
        open_volume(qtbot, window, volume)
        return window

    return start
