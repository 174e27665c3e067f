"""The window on the screens that people have: everything has room, and nothing is cut."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QPoint, QRect
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractScrollArea,
    QAbstractSpinBox,
    QApplication,
    QLineEdit,
    QMenuBar,
    QWidget,
)

from app.window.main_window import MainWindow

SIZES = (
    (800, 450), (853, 450), (960, 540), (1000, 640), (1093, 614), (1280, 720), (1366, 768),
    (1440, 900), (1920, 1080),
)  # fmt: skip
"""Windows in logical pixels; among them 1366 x 768 at 125 %, 1920 x 1080 at 150 and at 200 %,
1280 x 720 at 150 % below a task bar, and 1600 x 900 at 200 %."""

ROOM = {(1440, 900): (520, 470), (1000, 640): (350, 300)}
"""Least height of the images, and side of the browser's squares, by the window's size."""

CONTROLS = QAbstractButton, QAbstractSpinBox, QLineEdit, QMenuBar


def cut_in(window: QWidget) -> list[str]:
    """Names of controls that are seen, but not as a whole."""
    found = []
    for widget in window.findChildren(QWidget):
        if not isinstance(widget, CONTROLS) or not widget.isVisible():
            continue
        above = widget.parentWidget()
        # What scrolls comes into sight.
        while above is not None and not isinstance(above, QAbstractScrollArea):
            place = QRect(widget.mapTo(above, QPoint()), widget.size())
            if not above.rect().contains(place):
                name = widget.accessibleName() or widget.objectName() or type(widget).__name__
                found.append(f"{name} in {type(above).__name__}")
                break
            above = None if above is window else above.parentWidget()
    return found


def assert_whole(window: MainWindow, size: tuple[int, int]) -> None:
    QApplication.processEvents()
    least = window.minimumSizeHint()
    assert (window.width(), window.height()) == size
    assert least.width() <= 1000 and least.height() <= 640
    assert cut_in(window) == [], size


def test_everything_has_room_and_nothing_is_cut(make_window: Callable[..., MainWindow]) -> None:
    window = make_window()
    image, browser = window.reference.canvas, window.browser
    for size in SIZES:
        window.up_axis_card.hide()
        window.resize(*size)
        assert_whole(window, size)
        alone = image.size()
        window.crop_card.set_shown(True)
        window.up_axis_card.ask("+z")
        for number in range(2):
            window.notice.tell(f"/a/folder/engine{number}.nrrd: the file is truncated; copy it.")
        assert_whole(window, size)
        # What floats moves nothing.
        assert image.size() == alone
        window.latent_state.choose(shown=True)
        assert_whole(window, size)
        if size in ROOM:
            assert alone.height() >= ROOM[size][0]
            assert min(browser.map.width(), browser.grid.width()) >= ROOM[size][1]
            assert image.width() >= 220
        window.latent_state.choose(shown=False)
        window.crop_card.set_shown(False)
        window.notice.clear()
