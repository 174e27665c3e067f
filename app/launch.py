"""Opens the window, on the screen or for one screenshot."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtGui import QFontDatabase, QIcon
from PySide6.QtWidgets import QApplication

from app.engines.engines import REAL_BUILDERS, Builders, GeneratorSettings
from app.state.transfer_function_store import TransferFunctionStore
from app.theme import apply_theme
from app.window.main_window import MainWindow

ICON = Path(__file__).parent.parent / "resources" / "icons" / "tfscope.png"

SCREENSHOT_PATIENCE_S = 300
"""When a screenshot is taken of what there is, even if an image is missing."""

_SIGNAL_TICK_MS = 200


def run_window(
    volume_path: Path,
    model_path: Path | None,
    settings: GeneratorSettings,
    screenshot: Path | None,
    builders: Builders = REAL_BUILDERS,
) -> int:
    """Open the window and stay until it is closed.

    Parameters
    ----------
    volume_path : Path
    model_path : Path or None
        A model's folder.
    settings : GeneratorSettings
        How the generator is run.
    screenshot : Path or None
        When given, the window opens off screen, is saved there as PNG as soon
        as both images are final, and closes.
    builders : Builders
        What reads volumes and builds engines.

    Returns
    -------
    int
        Exit code: 0; 2 when a screenshot shows an error, or without a display.
    """
    if screenshot is None and not _display_is_there():
        print(
            "There is no display to open a window on; "
            "give --screenshot OUT.png for a picture of the window instead.",
            file=sys.stderr,
        )
        return 2
    if screenshot is not None:
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
        # That platform warns of every hint that it cannot pass to a window manager.
        os.environ.setdefault("QT_LOGGING_RULES", "default.warning=false")
    # Torch beside other busy threads: OpenMP's spinning would slow all of them.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    application = _application()
    store = TransferFunctionStore.of_user() if screenshot is None else None
    window = MainWindow(builders, store, settings)
    window.workspace.open_model(model_path)
    window.workspace.open_volume(volume_path)
    window.show()
    try:
        if screenshot is not None:
            return _take_screenshot(application, window, screenshot)
        with _interrupts_call(window.close):
            return application.exec()
    finally:
        window.close()
        window.deleteLater()
        application.processEvents()


def _application() -> QApplication:
    """Return the one application, made and styled at the first call."""
    application = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(application, QApplication)
    application.setApplicationName("tfscope")
    application.setWindowIcon(QIcon(str(ICON)))
    apply_theme(application)
    if not QFontDatabase.families():
        print(
            "No fonts are installed, so the window has no text; "
            "on Debian or Ubuntu: apt-get install fonts-dejavu-core",
            file=sys.stderr,
        )
    return application


def _display_is_there() -> bool:
    """Whether Qt has somewhere to open a window; only Linux can be without."""
    if not sys.platform.startswith("linux"):
        return True
    return any(os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"))


def _take_screenshot(application: QApplication, window: MainWindow, path: Path) -> int:
    """Wait for both images, save the window, and say what is wrong in it."""
    # A loop of its own: quitting the application would also end the loops that come later.
    waiting = QEventLoop()
    window.workspace.settled.connect(waiting.quit)
    patience = QTimer(singleShot=True, interval=1000 * SCREENSHOT_PATIENCE_S)
    patience.timeout.connect(waiting.quit)
    patience.start()
    with _interrupts_call(waiting.quit):
        if not window.workspace.is_settled:
            waiting.exec()
    patience.stop()
    # What the last signal changed is laid out and painted first.
    application.processEvents()
    problems = window.errors
    if not window.workspace.is_settled:
        problems = [*problems, "The screenshot was taken before both images were there."]
    if not window.grab().save(str(path), "PNG"):
        problems = [*problems, f"{path}: the screenshot cannot be written; choose another place."]
    for problem in problems:
        print(problem, file=sys.stderr)
    return 2 if problems else 0


@contextmanager
def _interrupts_call(action: Callable[[], object]) -> Iterator[None]:
    """Let Ctrl-C in the terminal call an action, instead of raising an exception in Qt."""
    before = signal.signal(signal.SIGINT, lambda *_: action())
    # Python runs signal handlers only between its own instructions: give it some.
    tick = QTimer(interval=_SIGNAL_TICK_MS)
    tick.timeout.connect(lambda: None)
    tick.start()
    try:
        yield
    finally:
        tick.stop()
        signal.signal(signal.SIGINT, before)
