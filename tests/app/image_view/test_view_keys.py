from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence, QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from app.image_view.gestures import ViewKeys, zoom
from app.state.viewer_state import HOME_VIEW, ViewerState
from model.scene.view import View

PLAIN = Qt.KeyboardModifier.NoModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier
CONTROL = Qt.KeyboardModifier.ControlModifier


@pytest.fixture
def image(qtbot: QtBot, state: ViewerState) -> Iterator[QWidget]:
    widget = QWidget()
    ViewKeys(widget, state)
    qtbot.addWidget(widget)
    yield widget
    state.finish_view()


@pytest.mark.parametrize(
    ("key", "keys", "expected"),
    [
        (Qt.Key.Key_Right, PLAIN, View(25.0, 15.0, 0.0, 0.8)),
        (Qt.Key.Key_Left, SHIFT, View(31.0, 15.0, 0.0, 0.8)),
        (Qt.Key.Key_Up, PLAIN, View(30.0, 10.0, 0.0, 0.8)),
        (Qt.Key.Key_Down, SHIFT, View(30.0, 16.0, 0.0, 0.8)),
        (Qt.Key.Key_Right, CONTROL, View(30.0, 15.0, 0.0, 0.8, 0.1, 0.0)),
        (Qt.Key.Key_Down, CONTROL | SHIFT, View(30.0, 15.0, 0.0, 0.8, 0.0, -0.02)),
        (Qt.Key.Key_PageDown, PLAIN, View(30.0, 15.0, 5.0, 0.8)),
        (Qt.Key.Key_PageUp, SHIFT, View(30.0, 15.0, -1.0, 0.8)),
        (Qt.Key.Key_Plus, SHIFT, zoom(HOME_VIEW, 1)),
        (Qt.Key.Key_Minus, Qt.KeyboardModifier.KeypadModifier, zoom(HOME_VIEW, -1)),
        (Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier, HOME_VIEW),
        (Qt.Key.Key_Plus, CONTROL, HOME_VIEW),
        (Qt.Key.Key_R, PLAIN, HOME_VIEW),
    ],
)
def test_keys(
    state: ViewerState,
    image: QWidget,
    key: Qt.Key,
    keys: Qt.KeyboardModifier,
    expected: View,
) -> None:
    QTest.keyClick(image, key, keys)
    got, want = vars(state.view), vars(expected)
    assert [*got.values()] == pytest.approx([*want.values()], abs=1e-9)
    assert not state.live


def repeat(image: QWidget, kind: QEvent.Type) -> None:
    event = QKeyEvent(kind, Qt.Key.Key_Right, PLAIN, "", True)
    QApplication.sendEvent(image, event)


def test_a_key_that_is_held_is_a_drag(qtbot: QtBot, state: ViewerState, image: QWidget) -> None:
    signals = [state.viewChanged] * 3 + [state.viewChangeFinished]
    with qtbot.waitSignals(signals, order="strict"):
        QTest.keyPress(image, Qt.Key.Key_Right)
        for _ in range(2):
            # As Qt reports it: a release and a press for every repetition.
            repeat(image, QEvent.Type.KeyRelease)
            repeat(image, QEvent.Type.KeyPress)
        assert state.live
        QTest.keyRelease(image, Qt.Key.Key_Right)
    assert state.view.azimuth == pytest.approx(15.0)
    # It ends when the focus goes, too.
    QTest.keyPress(image, Qt.Key.Key_Right)
    assert state.live
    QApplication.sendEvent(image, QFocusEvent(QEvent.Type.FocusOut))
    assert not state.live


def test_the_image_gets_its_keys_before_shortcuts(
    qtbot: QtBot, state: ViewerState, image: QWidget
) -> None:
    called: list[bool] = []
    QShortcut(QKeySequence("Home"), image).activated.connect(lambda: called.append(True))
    state.set_view(View(100.0))
    image.show()
    image.activateWindow()
    image.setFocus()
    qtbot.waitUntil(image.hasFocus)
    QTest.keyClick(image, Qt.Key.Key_Home)
    assert (state.view, called) == (state.home, [])
