"""Tab over every control of the window, with everything open: order, reach and names."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QWidget,
)
from pytestqt.qtbot import QtBot
from superqt import QDoubleRangeSlider

from app.image_view.image_canvas import ImageCanvas
from app.window.main_window import MainWindow
from model.scene.region import Outline

WindowMaker = Callable[..., MainWindow]

CONTROLS = QAbstractButton, QAbstractSpinBox, QAbstractSlider, QComboBox, QLineEdit, ImageCanvas

MOST = 200
"""Keys after which Tab goes round in a circle without the first one."""


@pytest.fixture
def window(qtbot: QtBot, make_window: WindowMaker) -> MainWindow:
    """A window with a region, all cards, a notice and the panel."""
    window = make_window()
    window.resize(1600, 1000)
    window.sensitivity_state.add_region(Outline.rectangle(0.3, 0.3, 0.7, 0.6))
    window.crop_card.set_shown(True)
    window.up_axis_card.ask("+z")
    window.notice.tell("It failed.", tone="error")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    window.editor.select_strongest()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    return window


def walked(qtbot: QtBot, window: MainWindow, key: Qt.Key = Qt.Key.Key_Tab) -> list[QWidget]:
    """What has the focus, one after the other, until the first one has it again."""
    first = window.top_bar.volume
    first.setFocus()
    qtbot.waitUntil(first.hasFocus)
    found: list[QWidget] = [first]
    for _ in range(MOST):
        QTest.keyClick(found[-1], key)
        following = QApplication.focusWidget()
        assert following is not None
        if following is first:
            return found
        if following is found[-1]:
            # From one of its ends, or handles, to the next.
            continue
        assert following not in found, (name_of(following), [name_of(each) for each in found])
        found.append(following)
    raise AssertionError([name_of(each) for each in found])


def controls(window: MainWindow) -> Iterator[QWidget]:
    """Everything in sight that can be used."""
    for widget in window.findChildren(QWidget):
        inner = isinstance(widget.parentWidget(), (QAbstractSpinBox, QLineEdit, QComboBox))
        is_shown = (
            widget.isVisible() and widget.isEnabled() and not widget.visibleRegion().isEmpty()
        )
        # The keys' way to the planes of the crop box are the numbers beside its sliders.
        is_for_mice = isinstance(widget, QDoubleRangeSlider)
        if isinstance(widget, CONTROLS) and is_shown and not (inner or is_for_mice):
            yield widget


def name_of(widget: QWidget) -> str:
    """What a screen reader says."""
    interface = QAccessible.queryAccessibleInterface(widget)
    return interface.text(QAccessible.Text.Name) if interface else ""


def test_tab_reaches_every_control_and_each_has_a_name(qtbot: QtBot, window: MainWindow) -> None:
    reached = walked(qtbot, window)
    areas = {
        "top bar": window.top_bar,
        "tools": window.tools,
        "left image": window.generator.canvas,
        "right image": window.reference.canvas,
        "notice": window.notice,
        "crop": window.crop_card,
        "up axis": window.up_axis_card,
        "editor": window.editor,
        "panel": window.sensitivity.findings,
    }

    def area(widget: QWidget) -> str:
        above: QWidget | None = widget
        while above is not None:
            for name, part in areas.items():
                if part is above:
                    return name
            above = above.parentWidget()
        return name_of(widget)

    seen = [area(widget) for widget in reached]
    order = [seen[0], *(new for old, new in pairwise(seen) if new != old)]
    assert order == list(areas), order
    for browsing in (False, True):
        window.latent_state.choose(shown=browsing)
        reached = walked(qtbot, window)
        missed = [name_of(widget) for widget in controls(window) if widget not in reached]
        assert missed == []
        assert len(reached) > 40
        assert [type(widget).__name__ for widget in reached if not name_of(widget)] == []
        back = walked(qtbot, window, Qt.Key.Key_Backtab)
        assert back[1:] == reached[:0:-1]
