import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog

from app.window.figure import FigureChoice
from app.window.figure_dialog import FigureDialog


@pytest.fixture
def dialog(qtbot):
    dialog = FigureDialog({"reference": (960, 720)}, FigureChoice(0, 0))
    qtbot.addWidget(dialog)
    return dialog


def choose(dialog, box_name, text):
    """Choose an entry as a click does."""
    box = getattr(dialog, box_name)
    row = next(i for i in range(box.count()) if text in box.itemText(i))
    box.setCurrentIndex(row)
    box.activated.emit(row)


def test_each_of_what_it_may_show_has_its_proportions(qtbot):
    sizes = {
        "reference": (960, 720), "generator": (128, 128), "both": (1454, 720),
        "difference": (720, 720),
    }  # fmt: skip
    dialog = FigureDialog(sizes, FigureChoice(0, 0, legend=True, scale_bar=True, which="both"))
    qtbot.addWidget(dialog)
    assert dialog.choice() == FigureChoice(1454, 720, (0, 0, 0), True, True, "both")
    choose(dialog, "size_box", "1024")
    for text, which, size in (
        ("Generator", "generator", (1024, 1024)),
        ("Ground truth", "reference", (1024, 768)),
    ):
        choose(dialog, "which_box", text)
        choice = dialog.choice()
        assert (choice.which, choice.width, choice.height) == (which, *size)
    # An own width stays, with the height of these proportions.
    dialog.width_box.setValue(2000)
    choose(dialog, "which_box", "Difference")
    assert (dialog.choice().width, dialog.choice().height) == (2000, 2000)
    assert dialog.legend_box.isHidden() and dialog.background_box.isHidden()
    choose(dialog, "which_box", "Both")
    assert not dialog.legend_box.isHidden() and dialog.movie_box.isHidden()


@pytest.mark.parametrize("background", [None, (255, 255, 255), (3, 60, 90)])
def test_the_last_choice_comes_back(qtbot, background):
    last = FigureChoice(64, 64, background, True)
    dialog = FigureDialog({"reference": (20000, 10000)}, last)
    qtbot.addWidget(dialog)
    assert dialog.choice() == FigureChoice(8192, 4096, background, True)
    dialog.copy_button.click()
    assert dialog.result() == QDialog.DialogCode.Accepted and dialog.copies


def test_a_movie_has_even_sides_that_players_show_and_a_background(qtbot):
    dialog = FigureDialog({"reference": (20001, 10000)}, FigureChoice(0, 0, None, seconds=2.0))
    qtbot.addWidget(dialog)
    assert dialog.choice() == FigureChoice(4096, 2048, (0, 0, 0), seconds=2.0)
    assert dialog.copy_button.isHidden()
    dialog.rate_box.setValue(10)
    assert dialog.choice().frame_count == 20
    dialog.movie_box.setChecked(False)
    assert dialog.choice().frame_count == 0 and not dialog.copy_button.isHidden()
    assert dialog.seconds_box.isHidden()
    dialog.width_box.setValue(8192)
    assert dialog.choice() == FigureChoice(8192, 4096, None, rate=10)


def test_each_choice_is_previewed(qtbot, dialog):
    asked = []
    dialog.preview = asked.append
    dialog.legend_box.setChecked(True)
    choose(dialog, "background_box", "White")
    choose(dialog, "size_box", "1024")
    assert [(one.legend, one.background, one.width) for one in dict.fromkeys(asked)] == [
        (True, (0, 0, 0), 960), (True, (255, 255, 255), 960), (True, (255, 255, 255), 1024),
    ]  # fmt: skip


def test_a_size_is_taken_on_tab_and_enter_takes_none_that_cannot_be(qtbot, dialog):
    dialog.show()
    qtbot.waitExposed(dialog)
    dialog.width_box.setFocus()
    qtbot.waitUntil(dialog.width_box.hasFocus)
    dialog.width_box.selectAll()
    QTest.keyClicks(dialog.width_box, "2000")
    QTest.keyClick(dialog.width_box, Qt.Key.Key_Tab)
    assert (dialog.choice().width, dialog.choice().height) == (2000, 1500)
    assert dialog.width_box.text() == "2000 px"
    dialog.height_box.selectAll()
    QTest.keyClicks(dialog.height_box, "12")
    QTest.keyClick(dialog.height_box, Qt.Key.Key_Return)
    assert dialog.isVisible() and dialog.height_box.text().startswith("12")
    dialog.height_box.selectAll()
    QTest.keyClicks(dialog.height_box, "1200")
    QTest.keyClick(dialog.height_box, Qt.Key.Key_Return)
    assert dialog.result() == QDialog.DialogCode.Accepted
    assert (dialog.choice().width, dialog.choice().height) == (1600, 1200)
