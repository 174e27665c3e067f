"""Opening of the window, on the screen or off screen for a screenshot."""

import gc
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from pyqtgraph.util.garbage_collector import GarbageCollector
from PySide6.QtCore import QEventLoop, Qt, QTimer
from PySide6.QtGui import QFontDatabase, QIcon
from PySide6.QtWidgets import QApplication

from app.engines.engines import REAL_BUILDERS, Builders
from app.picture import save_image
from app.state.preferences import Preferences, user_folder
from app.state.volume_opening import Wanted
from app.state.window_start import WindowStart
from app.theme import apply_theme
from app.window.main_window import MainWindow
from model.errors import RenderError

ICON = Path(__file__).parent.parent / "resources" / "icons" / "tfscope.png"

SCREENSHOT_PATIENCE_S = 300  # time after which a screenshot is taken even if an image is missing
DISPLAY_PATIENCE_S = 5.0  # time within which a display answers
_SIGNAL_TICK_MS = 200


def run_window(
    start: WindowStart, device: str, screenshot: Path | None, builders: Builders = REAL_BUILDERS
) -> int:
    """Open the window and run until it is closed; return 0, or 2 if it cannot be shown.

    For a screenshot it is opened off screen, saved to this PNG file once both images are final, and
    closed; 2 is returned if it shows an error. The device is the generator's.
    """
    if screenshot is None and not _display_is_there():
        where = "give --screenshot OUT.png for a picture of the window instead."
        print(f"There is no display to open a window on; {where}", file=sys.stderr)
        return 2
    if screenshot is not None:
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
        # A size is in pixels, whatever the screen's scale is.
        os.environ["QT_SCALE_FACTOR"] = "1"
        os.environ.pop("QT_SCREEN_SCALE_FACTORS", None)
        # The offscreen platform warns of every unsupported window-manager hint.
        os.environ.setdefault("QT_LOGGING_RULES", "default.warning=false")
    application = _application()
    preferences = Preferences(user_folder() if screenshot is None else None)
    apply_theme(application, preferences.settings.theme)
    application.styleHints().colorSchemeChanged.connect(
        lambda _scheme: apply_theme(application, preferences.settings.theme)
    )
    window = MainWindow(builders.on(device), preferences)
    window.workspace.reference.is_patient = screenshot is not None
    if start.size is not None:
        window.resize(*start.size)
    _open(window, start)
    window.show()
    try:
        if screenshot is not None:
            return _take_screenshot(application, window, screenshot)
        with _interrupts_call(partial(_end, application, window)), garbage_collected_here():
            return application.exec()
    finally:
        window.close()
        window.deleteLater()
        application.processEvents()


@contextmanager
def garbage_collected_here() -> Iterator[None]:
    """Collect garbage in this thread only, at intervals.

    Otherwise Python collects in any thread, and Qt objects that are destroyed in an engine's thread
    crash the window.
    """
    collector = GarbageCollector(interval=0.5)
    try:
        yield
    finally:
        collector.timer.stop()
        gc.enable()


def _open(window: MainWindow, start: WindowStart) -> None:
    """Open and show what a start asks for."""
    workspace = window.workspace
    looks = {"lighting": start.lighting, "drawing": start.renderer}
    chosen = {name: choice for name, choice in looks.items() if choice is not None}
    workspace.reference.choose(keep=False, **chosen)
    # The volume's range and first view are known only now.
    workspace.volumeStarted.connect(
        partial(_show_as_asked, window, start), Qt.ConnectionType.SingleShotConnection
    )
    if start.session is not None:
        window.sessions.open(start.session, start.volume)
    else:
        wanted = Wanted(scalar_range=start.scalar_range, scale=start.scale)
        window.files.read(start.volume, start.choice, wanted)
    if start.model is not None:
        workspace.open_model(start.model)


def _show_as_asked(window: MainWindow, start: WindowStart) -> None:
    state = window.state
    if start.view is not None:
        state.set_view(start.view)
    if start.crop is not None:
        state.crop_input.set(start.crop)
    if start.clip is not None:
        state.clip_input.set(start.clip)
    if start.crop is not None or start.clip is not None:
        window.crop_card.set_shown(True)
    if start.light is not None and state.light is not None:
        state.start_light(start.light)
    elif start.light is not None:
        window.notice.add("The light cannot be moved: the model was trained with a fixed light.")
    if start.tf is not None:
        window.files.open_transfer_function(start.tf)


def _end(application: QApplication, window: MainWindow) -> None:
    """Close the window and end the program, whatever else is still on screen."""
    if window.close():
        application.quit()


def _application() -> QApplication:
    """Return the application, created by the first call."""
    application = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(application, QApplication)
    application.setApplicationName("tfscope")
    application.setWindowIcon(QIcon(str(ICON)))
    if not QFontDatabase.families():
        remedy = "on Debian or Ubuntu: apt-get install fonts-dejavu-core"
        print(f"No fonts are installed, so the window has no text; {remedy}", file=sys.stderr)
    return application


def _display_is_there() -> bool:
    """Return whether a display answers; Qt would end the process if it does not."""
    if not sys.platform.startswith("linux") or os.environ.get("QT_QPA_PLATFORM"):
        return True
    if wayland := os.environ.get("WAYLAND_DISPLAY"):
        # An absolute name replaces the folder.
        place = os.path.join(os.environ.get("XDG_RUNTIME_DIR", ""), wayland)  # noqa: PTH118
        if _answers(socket.AF_UNIX, place):
            return True
    host, _, number = os.environ.get("DISPLAY", "").partition("/")[0].rpartition(":")
    number = number.partition(".")[0]
    if not number.isdecimal():
        return False
    if host in ("", "unix"):
        local = f"/tmp/.X11-unix/X{number}"
        return any(_answers(socket.AF_UNIX, place) for place in (local, f"\0{local}"))
    return _answers(socket.AF_INET, (host, 6000 + int(number)))


def _answers(family: socket.AddressFamily, place: str | tuple[str, int]) -> bool:
    with socket.socket(family, socket.SOCK_STREAM) as end:
        end.settimeout(DISPLAY_PATIENCE_S)
        try:
            end.connect(place)
        except OSError:
            return False
        return True


def _take_screenshot(application: QApplication, window: MainWindow, path: Path) -> int:
    """Wait for both images, save the window, print errors, and return the exit code."""
    # A separate loop, as quitting the application would also end later loops.
    waiting = QEventLoop()
    window.workspace.settled.connect(waiting.quit)
    patience = QTimer(singleShot=True, interval=1000 * SCREENSHOT_PATIENCE_S)
    patience.timeout.connect(waiting.quit)
    patience.start()
    preparation = window.workspace.reference.preparation
    preparation.progressed.connect(
        lambda *_: sys.stderr.write(f"{preparation.text}\n" * bool(preparation.text)),
        Qt.ConnectionType.SingleShotConnection,
    )
    with _interrupts_call(partial(patience.start, 0)):
        # Pending layout and paint events may ask for other images.
        application.processEvents()
        while not window.workspace.is_settled and patience.isActive():
            waiting.exec()
            application.processEvents()
    patience.stop()
    problems = window.errors
    if not window.workspace.is_settled:
        problems = [*problems, "The screenshot was taken before both images were there."]
    try:
        save_image(path, window.grab().toImage())
    except RenderError as error:
        problems = [*problems, str(error)]
    for problem in problems:
        print(problem, file=sys.stderr)
    return 2 if problems else 0


@contextmanager
def _interrupts_call(action: Callable[[], object]) -> Iterator[None]:
    """Make Ctrl-C in the terminal call an action instead of raising an exception in Qt."""
    before = signal.signal(signal.SIGINT, lambda *_: action())
    # Python runs signal handlers only between bytecode instructions, so run some regularly.
    tick = QTimer(interval=_SIGNAL_TICK_MS)
    tick.timeout.connect(lambda: None)
    tick.start()
    try:
        yield
    finally:
        tick.stop()
        signal.signal(signal.SIGINT, before)
