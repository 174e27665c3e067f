from itertools import pairwise

import pytest
from mouse_events import wheel
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QAccessible
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QScrollBar,
    QTabBar,
    QWidget,
)
from superqt import QDoubleRangeSlider

from app.image_view.image_canvas import ImageCanvas
from app.window.figure import FigureChoice
from app.window.figure_dialog import FigureDialog
from app.window.raw_dialog import RawDialog
from app.window.settings_dialog import SettingsDialog
from model.scene.region import Outline

CONTROLS = QAbstractButton, QAbstractSpinBox, QAbstractSlider, QComboBox, QLineEdit, ImageCanvas

MOST = 200  # keys after which Tab goes round in a circle without the first one


def controls_of(parent):
    """Everything that shows a value and might take the wheel, in menus and popups, too."""
    kinds = (QAbstractSpinBox, QComboBox, QAbstractSlider, QTabBar)
    found = [w for kind in kinds for w in parent.findChildren(kind)]
    return [w for w in found if not isinstance(w, QScrollBar)]


def shown_by(control):
    if isinstance(control, QAbstractSpinBox):
        return control.text()
    if isinstance(control, QComboBox | QTabBar):
        return control.currentIndex()
    return control.value()


def assert_wheel_changes_nothing(parent):
    controls = controls_of(parent)
    for control in controls:
        before, name = shown_by(control), control.accessibleName() or control.toolTip()
        control.clearFocus()
        for notches in (1, -1, -1):
            wheel(control, QPointF(control.rect().center()), notches)
            assert shown_by(control) == before, f"{control} {name}"
        assert not control.hasFocus(), f"{control} {name}"
        assert control.focusPolicy() != Qt.FocusPolicy.WheelFocus, f"{control} {name}"
    return len(controls)


@pytest.fixture
def window(qtbot, make_window):
    """A window with a region, all cards, a notice and the panel."""
    window = make_window()
    window.resize(1600, 1000)
    window.sensitivity_state.add_region(Outline.rectangle(0.3, 0.3, 0.7, 0.6))
    window.crop_card.set_shown(True)
    window.up_axis_card.ask()
    window.notice.add("It failed.", tone="error")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    window.editor.moves.select_strongest()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    return window


def walked(qtbot, window, key=Qt.Key.Key_Tab):
    """What has the focus, one after the other, until the first one has it again."""
    first = window.top_bar.volume
    first.setFocus()
    qtbot.waitUntil(first.hasFocus)
    found = [first]
    for _ in range(MOST):
        QTest.keyClick(found[-1], key)
        following = QApplication.focusWidget()
        if following is first:
            return found
        if following is found[-1]:
            # From one of its ends, or handles, to the next.
            continue
        assert following not in found, (name_of(following), [name_of(each) for each in found])
        found.append(following)
    raise AssertionError([name_of(each) for each in found])


def controls(window):
    for widget in window.findChildren(QWidget):
        inner = isinstance(widget.parentWidget(), (QAbstractSpinBox, QLineEdit, QComboBox))
        is_shown = (
            widget.isVisible() and widget.isEnabled() and not widget.visibleRegion().isEmpty()
        )
        # The keys' way to the planes of the crop box are the numbers beside its sliders.
        is_for_mice = isinstance(widget, QDoubleRangeSlider)
        if isinstance(widget, CONTROLS) and is_shown and not (inner or is_for_mice):
            yield widget


def name_of(widget):
    """What a screen reader says."""
    interface = QAccessible.queryAccessibleInterface(widget)
    return interface.text(QAccessible.Text.Name) if interface else ""


def test_tab_reaches_every_control_and_each_has_a_name(qtbot, window):
    reached = walked(qtbot, window)
    areas = {
        "top bar": window.top_bar, "tools": window.tools, "left image": window.generator.canvas,
        "right image": window.reference.canvas, "notice": window.notice, "crop": window.crop_card,
        "up axis": window.up_axis_card, "editor": window.editor,
        "panel": window.sensitivity.findings,
    }  # fmt: skip

    def area(widget):
        above = widget
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
    # And none follows the wheel unasked.
    window.latent_state.choose(shown=True)
    tf, crop = window.state.transfer_function, window.state.crop
    choices = window.sensitivity_state.choices, window.latent_state.choices
    assert assert_wheel_changes_nothing(window) >= 15
    assert (window.state.transfer_function, window.state.crop) == (tf, crop)
    assert (window.sensitivity_state.choices, window.latent_state.choices) == choices
    assert window.brightness.value is None


def test_nor_do_those_of_the_dialogs(qtbot, window, tmp_path):
    path = tmp_path / "data.raw"
    path.write_bytes(bytes(1000))
    raw = RawDialog(path)
    movie = FigureDialog({"reference": (640, 480)}, FigureChoice(0, 0, samples=16, seconds=3.0))
    settings = SettingsDialog(window.context, window.overlays)
    for dialog, least in ((raw, 3), (movie, 7), (settings, 3)):
        qtbot.addWidget(dialog)
        dialog.show()
        qtbot.waitExposed(dialog)
        assert assert_wheel_changes_nothing(dialog) >= least
    raw.done(0)
    settings.done(0)
