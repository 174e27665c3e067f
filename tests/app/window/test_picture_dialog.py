from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog, QPushButton

from app.window.figure import Which
from app.window.picture_dialog import PictureChoice, PictureDialog


@pytest.fixture
def dialog(qtbot):
    dialog = PictureDialog({"reference": (960, 720)})
    qtbot.addWidget(dialog)
    return dialog


def choose(dialog: PictureDialog, box_name: str, text: str) -> None:
    """Choose an entry as a click does."""
    box = getattr(dialog, box_name, None) or getattr(dialog.chooser, box_name)
    row = next(i for i in range(box.count()) if text in box.itemText(i))
    box.setCurrentIndex(row)
    box.activated.emit(row)


def test_each_of_what_it_may_show_has_its_proportions(qtbot):
    sizes: dict[Which, tuple[int, int]] = {
        "reference": (960, 720),
        "generator": (128, 128),
        "both": (1454, 720),
        "difference": (720, 720),
    }
    dialog = PictureDialog(sizes, PictureChoice(0, 0, legend=True, scale_bar=True, which="both"))
    qtbot.addWidget(dialog)
    assert dialog.choice() == PictureChoice(1454, 720, (0, 0, 0), True, True, "both")
    choose(dialog, "size_box", "1024")
    for text, which, size in (
        ("Generator", "generator", (1024, 1024)),
        ("Ground truth", "reference", (1024, 768)),
    ):
        choose(dialog, "which_box", text)
        choice = dialog.choice()
        assert (choice.which, choice.width, choice.height) == (which, *size)
    # An own width stays, with the height of these proportions.
    dialog.chooser.width_box.setValue(2000)
    choose(dialog, "which_box", "Difference")
    assert (dialog.choice().width, dialog.choice().height) == (2000, 2000)
    assert not dialog.legend_box.isEnabled() and not dialog.background_box.isEnabled()
    choose(dialog, "which_box", "Both")
    assert dialog.legend_box.isEnabled()


@pytest.mark.parametrize("background", [None, (255, 255, 255), (3, 60, 90)])
def test_the_last_choice_comes_back(qtbot, background):
    last = PictureChoice(64, 64, background, True)
    dialog = PictureDialog({"reference": (20000, 10000)}, last, "Copy")
    qtbot.addWidget(dialog)
    assert dialog.choice() == PictureChoice(8192, 4096, background, True)
    (accept,) = [b for b in dialog.findChildren(QPushButton) if b.text() == "Copy"]
    accept.click()
    assert dialog.result() == QDialog.DialogCode.Accepted


def test_a_size_is_taken_on_tab_and_enter_takes_none_that_cannot_be(qtbot, dialog):
    dialog.show()
    qtbot.waitExposed(dialog)
    dialog.chooser.width_box.setFocus()
    qtbot.waitUntil(dialog.chooser.width_box.hasFocus)
    dialog.chooser.width_box.selectAll()
    QTest.keyClicks(dialog.chooser.width_box, "2000")
    QTest.keyClick(dialog.chooser.width_box, Qt.Key.Key_Tab)
    assert (dialog.choice().width, dialog.choice().height) == (2000, 1500)
    assert dialog.chooser.width_box.text() == "2000 px"
    dialog.chooser.height_box.selectAll()
    QTest.keyClicks(dialog.chooser.height_box, "12")
    QTest.keyClick(dialog.chooser.height_box, Qt.Key.Key_Return)
    assert dialog.isVisible() and dialog.chooser.height_box.text().startswith("12")
    dialog.chooser.height_box.selectAll()
    QTest.keyClicks(dialog.chooser.height_box, "1200")
    QTest.keyClick(dialog.chooser.height_box, Qt.Key.Key_Return)
    assert dialog.result() == QDialog.DialogCode.Accepted
    assert (dialog.choice().width, dialog.choice().height) == (1600, 1200)
