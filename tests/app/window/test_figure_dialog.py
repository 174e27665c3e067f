import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog
from ramp import make_tf

from app.window.figure import FigureChoice, Subject, figure, panels, pixels_of
from app.window.figure_dialog import FigureDialog
from model.rendering.scale_bar import Scale
from model.scene.inputs import SceneInputs
from model.scene.view import View


@pytest.fixture
def dialog(qtbot):
    dialog = FigureDialog({"reference": (960, 720)}, FigureChoice(0, 0))
    qtbot.addWidget(dialog)
    return dialog


def choose(dialog, box_name, text):
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
    rows, box = dialog.size_box.view(), dialog.size_box
    choose(dialog, "size_box", "1024")
    for text, which, size in (
        ("Generator", "generator", (1024, 1024)),
        ("Ground truth", "reference", (1024, 768)),
    ):
        choose(dialog, "which_box", text)
        choice = dialog.choice()
        assert (choice.which, choice.width, choice.height) == (which, *size)
        listed = [box.itemData(n) for n in range(box.count()) if not rows.isRowHidden(n)]
        assert len(listed) == len(set(listed))
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


SCALE = Scale((0.577, 0.577, 0.577), 50.0, "mm", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
INPUTS = SceneInputs.of(View(), make_tf())
BLACK, WHITE = (0, 0, 0), (255, 255, 255)


def plain(level, height, width):
    image = np.full((height, width, 4), level, np.float32)
    image[..., 3] = 1.0
    return image


def made(choice, **images):
    subject = Subject("K", SCALE)
    drawn = {name: (image, 1.0) for name, image in images.items()}
    return pixels_of(figure(choice, drawn, INPUTS, subject)).astype(int)


pytestmark = pytest.mark.usefixtures("qapp")


@pytest.mark.parametrize("size", [(600, 600), (1000, 500), (500, 1000)])
@pytest.mark.parametrize(("background", "level"), [(BLACK, 0.0), (WHITE, 1.0)])
def test_the_scale_bar_is_as_long_as_the_scale_says(size, background, level):
    width, height = size
    image = plain(level, height, width)
    without = made(FigureChoice(width, height, background), reference=image)
    shown = made(FigureChoice(width, height, background, scale_bar=True), reference=image)
    assert (without == round(255 * level)).all()
    changed = np.abs(shown - without).max(axis=-1) > 128
    rows, columns = np.nonzero(changed)
    assert rows.min() > 0.9 * height and columns.max() < width / 2
    bar = SCALE.bar(INPUTS.view)
    length = bar.share * min(size)
    # The longest row of pixels is the bar.
    longest = changed.sum(axis=1).max()
    assert longest == pytest.approx(length, abs=4)


def test_both_are_squares_side_by_side():
    choice = FigureChoice(1212, 600, WHITE, True, True, "both")
    left, right = panels(choice)
    assert (left.width(), left.height()) == (right.width(), right.height()) == (600, 600)
    pixels = made(choice, generator=plain(0.2, 128, 128), reference=plain(0.6, 600, 600))
    assert (pixels[300, 10:590] == 51).mean() > 0.9
    assert (pixels[300, 625:900] == 153).mean() > 0.9
    assert (pixels[300, 604:608] == 255).all()
    # Captions at the upper left of each, the bar in the first, the legend in the last.
    for place, level in ((left, 51), (right, 153)):
        corner = pixels[:60, place.left() : place.left() + 200]
        assert (np.abs(corner - level) > 60).any()
    assert (np.abs(pixels[540:, :300] - 51) > 60).any()
    assert not (np.abs(pixels[200:520, 10:590] - 51) > 60).any()
    assert (np.abs(pixels[250:, 1000:1200] - 153) > 60).any()


def test_the_difference_is_brightest_where_it_is_largest():
    truth = plain(0.5, 300, 300)
    drawn = truth.copy()
    drawn[100:150, 100:150, :3] += 0.3
    choice = FigureChoice(300, 300, None, True, True, "difference")
    pixels = made(choice, generator=drawn, reference=truth)
    inside, outside = pixels[125, 125], pixels[60, 60]
    assert inside.sum() > outside.sum() + 60
    assert np.abs(pixels[240:, 150:] - outside).max() > 100
