from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QScrollBar,
    QSlider,
    QTabBar,
    QVBoxLayout,
    QWidget,
)
from pytestqt.qtbot import QtBot

from app.controls import list_box
from app.number_box import WholeNumberBox
from app.wheel_guard import WheelGuard
from app.window.main_window import MainWindow
from app.window.movie_saving import MovieDialog
from app.window.picture_dialog import PictureDialog
from app.window.raw_dialog import RawDialog

WindowMaker = Callable[..., MainWindow]


def controls_of(parent: QWidget) -> list[QWidget]:
    """Everything that shows a value and might take the wheel, in menus and popups, too."""
    kinds = (QAbstractSpinBox, QComboBox, QAbstractSlider, QTabBar)
    found = [w for kind in kinds for w in parent.findChildren(kind)]
    return [w for w in found if not isinstance(w, QScrollBar)]


def shown_by(control: QWidget) -> object:
    if isinstance(control, QAbstractSpinBox):
        return control.text()
    if isinstance(control, QComboBox | QTabBar):
        return control.currentIndex()
    assert isinstance(control, QAbstractSlider)
    return control.value()


def turn(control: QWidget, notches: int) -> None:
    at = QPointF(control.width() / 2, control.height() / 2)
    QApplication.sendEvent(
        control,
        QWheelEvent(
            at, QPointF(control.mapToGlobal(at.toPoint())), QPoint(), QPoint(0, 120 * notches),
            Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
            Qt.ScrollPhase.NoScrollPhase, False,
        ),
    )  # fmt: skip


def assert_wheel_changes_nothing(parent: QWidget) -> int:
    controls = controls_of(parent)
    for control in controls:
        before, name = shown_by(control), control.accessibleName() or control.toolTip()
        control.clearFocus()
        for notches in (1, -1, -1):
            turn(control, notches)
            assert shown_by(control) == before, f"{control} {name}"
        assert not control.hasFocus(), f"{control} {name}"
        assert control.focusPolicy() != Qt.FocusPolicy.WheelFocus, f"{control} {name}"
    return len(controls)


def test_no_control_of_the_window_follows_the_wheel_unasked(make_window: WindowMaker) -> None:
    window = make_window()
    window.crop_card.set_shown(True)
    window.latent_state.choose(shown=True)
    tf, crop = window.state.transfer_function, window.state.crop
    choices = window.sensitivity_state.choices, window.latent_state.choices
    assert assert_wheel_changes_nothing(window) >= 15
    assert (window.state.transfer_function, window.state.crop) == (tf, crop)
    assert (window.sensitivity_state.choices, window.latent_state.choices) == choices
    assert not window.brightness.is_chosen


def test_nor_do_those_of_the_dialogs(qtbot: QtBot, tmp_path: Path) -> None:
    path = tmp_path / "data.raw"
    path.write_bytes(bytes(1000))
    raw = RawDialog(path)
    movie = MovieDialog(640, 480)
    picture = PictureDialog({"reference": (640, 480)})
    for dialog, least in ((raw, 3), (picture, 4), (movie, 4)):
        qtbot.addWidget(dialog)
        dialog.show()
        qtbot.waitExposed(dialog)
        assert assert_wheel_changes_nothing(dialog) >= least
    raw.done(0)


@pytest.mark.parametrize("make", [WholeNumberBox, list_box, QSlider])
def test_one_with_the_focus_does(qtbot: QtBot, make: Callable[[], QWidget]) -> None:
    parent, control = QWidget(), make()
    qtbot.addWidget(parent)
    QVBoxLayout(parent).addWidget(control)
    if isinstance(control, QComboBox):
        control.addItems(["one", "two", "three"])
    elif isinstance(control, QSlider):
        WheelGuard(control)
    parent.show()
    qtbot.waitExposed(parent)
    control.setFocus()
    qtbot.waitUntil(control.hasFocus)
    before = shown_by(control)
    turn(control, -1)
    turn(control, -1)
    if shown_by(control) == before:
        turn(control, 1)
    assert shown_by(control) != before
