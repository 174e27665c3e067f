import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QToolTip, QVBoxLayout, QWidget

from app.number_box import NumberBox, WholeNumberBox


@pytest.fixture
def window(qtbot):
    window = QWidget()
    qtbot.addWidget(window)
    return window


@pytest.fixture
def boxes(qtbot, window):
    layout = QVBoxLayout(window)
    pixels, value = WholeNumberBox(), NumberBox()
    pixels.setRange(16, 8192)
    pixels.setSuffix(" px")
    pixels.setKeyboardTracking(False)
    pixels.show_value(1572)
    for box in (pixels, value):
        layout.addWidget(box)
    window.show()
    qtbot.waitExposed(window)
    window.activateWindow()
    pixels.setFocus()
    qtbot.waitUntil(pixels.hasFocus)
    return pixels, value


def type_over(box, text):
    box.setFocus()
    box.selectAll()
    QTest.keyClicks(box, text)


@pytest.mark.parametrize(
    ("limits", "text", "shown"),
    [
        ((0.0, 1.0), "0.12345678901234", ".123457"), ((1e-9, 3e-9), "2.5e-9", "2.5e-09"),
        ((-1000.0, 3000.0), "-12.5", "-12.5"), ((1e6, 1e6 + 1), "1000000.12345", "1000000.12345"),
    ],
)  # fmt: skip
def test_a_typed_number_is_kept_to_its_last_digit(qtbot, boxes, limits, text, shown):
    _, box = boxes
    box.set_limits(*limits)
    type_over(box, text)
    with qtbot.waitSignal(box.valueChanged) as changed:
        QTest.keyClick(box, Qt.Key.Key_Return)
    assert changed.args == [float(text)] and box.text() == shown
    # Enter once more, without typing, keeps the digits that are not shown.
    box.setFocus()
    QTest.keyClick(box, Qt.Key.Key_Return)
    assert box.value() == float(text)


@pytest.mark.parametrize("typed", ["5", "-3", "e-", "0,25", "1 000"])
def test_what_is_no_number_within_the_limits_is_not_taken(boxes, typed):
    _, box = boxes
    box.show_value(0.5)
    assert box.toolTip() == "From 0 to 1"
    type_over(box, typed)
    QTest.keyClick(box, Qt.Key.Key_Return)
    assert box.text() == typed and box.value() == 0.5 and box.property("refused")
    assert "From 0 to 1" in QToolTip.text()
    QTest.keyClick(box, Qt.Key.Key_Tab)
    assert box.text() == ".5" and not box.property("refused")


@pytest.mark.parametrize(
    ("typed", "value"), [("2000", 2000), ("2000 px", 2000), ("9000", 1572), ("12,3", 1572)]
)
def test_a_whole_number_is_taken_as_typed_or_not_at_all(boxes, typed, value):
    pixels, other = boxes
    pixels.selectAll()
    QTest.keyClicks(pixels, typed.removesuffix(" px"))
    if typed.endswith("px"):
        pixels.lineEdit().setText(typed)
    assert pixels.text().startswith(typed.removesuffix(" px"))
    QTest.keyClick(pixels, Qt.Key.Key_Tab)
    assert other.hasFocus() and pixels.value() == value and pixels.text() == f"{value} px"


def test_after_enter_keys_are_the_windows(window, boxes):
    heard = []
    for key in ("Ctrl+Z", "R"):
        QShortcut(key, window).activated.connect(lambda key=key: heard.append(key))
    for box, typed in zip(boxes, ("1400", ".25"), strict=True):
        type_over(box, typed)
        # Whoever types a letter means no command.
        QTest.keyClick(box, Qt.Key.Key_R)
        assert box.lineEdit().text().startswith(typed) and not heard
        QTest.keyClick(box, Qt.Key.Key_Return)
        assert box.parentWidget().hasFocus()
        QTest.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClick(window, Qt.Key.Key_R)
        assert heard == ["Ctrl+Z", "R"]
        heard.clear()
