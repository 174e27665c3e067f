import threading
from dataclasses import replace

import imageio.v3 as iio
import numpy as np
import pytest
from mouse_events import action
from PySide6.QtCore import Qt
from PySide6.QtGui import QFont, QFontMetricsF, QGuiApplication, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog, QFileDialog, QMessageBox, QPushButton
from ramp import make_tf
from rested_window import saved_figure
from window_fakes import PATIENCE_S, FakeEngine

from app.engines.requests import SupersededError
from app.image_view.engine_pane import EnginePane
from app.picture import pixels_of
from app.window.figure import Comparison, FigureChoice, Subject, figure
from app.window.figure_dialog import FigureDialog
from model.errors import RenderError
from model.rendering.scale_bar import Scale
from model.scene.inputs import SceneInputs
from model.scene.view import View


def declined(monkeypatch):
    """Cancel each dialog; what they begin with."""
    begun = []
    no = QDialog.DialogCode.Rejected
    monkeypatch.setattr(FigureDialog, "exec", lambda dialog: begun.append(dialog.choice()) or no)
    return begun


def test_figures_are_saved_and_copied(qtbot, window, builders, tmp_path, monkeypatch):
    for background in (None, (0, 0, 0)):
        choice, place = FigureChoice(90, 40, background), tmp_path / f"{background}.png"
        saved = saved_figure(qtbot, window, choice, place)
        assert (saved.width(), saved.height()) == (90, 40)
        assert saved.pixelColor(5, 5).getRgb() == (255, 255, 255, 255)
        assert saved.hasAlphaChannel() == (background is None)
        assert not saved.text("Error") and saved.dotsPerMeterX() == round(300 / 0.0254)
    for estimated, said in (
        (float("inf"), ""),
        (0.0042, "Estimated RMSE of colours from 0 to 1, by noise: .0042."),
    ):
        builders.references[-1].image_error = estimated
        place = tmp_path / f"{estimated}.png"
        text = saved_figure(qtbot, window, FigureChoice(90, 40), place).text("Error")
        assert text.startswith(said) and bool(text) == bool(said)
    choice = FigureChoice(300, 200, (0, 0, 0), legend=True)
    window.saving.draw(choice, None)
    qtbot.waitUntil(lambda: window.status.news == "Copied.")
    copied = QGuiApplication.clipboard().image()
    assert (copied.width(), copied.height()) == (300, 200)
    colors = {copied.pixel(x, y) for x in range(200, 300, 3) for y in range(60, 200, 3)}
    assert len(colors) > 5  # the legend
    place = tmp_path / "missing" / "picture.png"
    window.saving.draw(FigureChoice(20, 20), place)
    qtbot.waitUntil(lambda: "picture.png" in window.notice.text)
    assert not window.status.news
    # A movie's even sides, of proportions of even sides, are the image's.
    for shown, size, longer in (((1366, 515), (1024, 384), 1024), ((683, 515), (682, 514), 0)):
        with monkeypatch.context() as patched:
            patched.setattr(window.saving, "sizes", lambda shown=shown: {"reference": shown})
            saved_figure(qtbot, window, FigureChoice(*size), tmp_path / "even.png")
        first = window.saving.first_choice()
        assert (first.width, first.height) == (longer, 0)
    # The next figure begins in this size, or as large as the screen's again.
    width, height = window.saving.sizes()["reference"]
    half = width // 2, height // 2
    for size, kept in ((half, (max(half), 0)), ((90, 300), (90, 300)), ((width, height), (0, 0))):
        saved_figure(qtbot, window, FigureChoice(*size), tmp_path / f"{size}.png")
        first = window.saving.first_choice()
        assert (first.width, first.height) == kept
    # One is offered in its final size where there is an image.
    monkeypatch.undo()
    window.reference.canvas.show_image(None)
    window.saving.ask()
    assert "no image" in window.notice.text
    offered = declined(monkeypatch)
    window.reference.canvas.show_image(QImage(30, 30, QImage.Format.Format_RGB888))
    window.saving.ask()
    ((width, height),) = [(choice.width, choice.height) for choice in offered]
    assert (width, height) == window.reference.canvas.pixels
    window.status.say("")
    chosen = window.preferences.settings.figure
    action(window, "Copy image").trigger()
    qtbot.waitUntil(lambda: window.status.news == "Copied.")
    assert QGuiApplication.clipboard().image().size().toTuple() == (width, height)
    assert window.preferences.settings.figure == chosen
    assert "generator" not in window.saving.sizes()
    # Cancel of the dialog for files returns to this one, as it was.
    place = tmp_path / "white.png"
    answers, backgrounds = iter([("", ""), (str(place), "")]), []

    def yes(dialog):
        backgrounds.append(dialog.choice().background)
        dialog.background_box.show_background((255, 255, 255))
        return QDialog.DialogCode.Accepted

    monkeypatch.setattr(FigureDialog, "exec", yes)
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: next(answers))
    window.saving.ask()
    assert backgrounds == [(0, 0, 0), (255, 255, 255)]
    qtbot.waitUntil(place.exists)


def test_a_path_traced_picture_has_as_many_samples_as_were_asked_for(
    qtbot, window, tmp_path, monkeypatch
):
    asked = []

    def picture(self, request, is_wanted):
        asked.append(request.quality.samples)
        return np.full((40, 90, 4), 255, np.uint8)

    monkeypatch.setattr(FakeEngine, "picture", picture)
    assert window.saving.first_choice().samples == 0
    window.workspace.reference.choose(lighting="path")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert window.saving.first_choice().samples == 64
    # What is on the screen is not drawn again to be copied.
    action(window, "Copy image").trigger()
    qtbot.waitUntil(lambda: window.status.news == "Copied.")
    assert not asked
    choice = FigureChoice(90, 40, samples=256)
    saved = saved_figure(qtbot, window, choice, tmp_path / "picture.png")
    assert asked == [256]
    qtbot.waitUntil(lambda: "Saved" in window.status.news)
    assert saved.text("Light") == "path-traced light, 256 samples of each pixel"
    # The dialog remembers it, in the next run, too.
    assert window.saving.first_choice().samples == 256
    assert window.preferences.settings.figure.samples == 256
    # One that takes long says how far it is, and can be cancelled.
    begun, given_up = threading.Event(), threading.Event()

    def draw_slowly(self, request, watch):
        while watch.is_wanted():
            watch.note(0.5)
            begun.set()
            given_up.wait(0.02)
        given_up.set()
        raise SupersededError

    monkeypatch.setattr(FakeEngine, "picture", draw_slowly)
    place = tmp_path / "slow.png"
    window.saving.draw(FigureChoice(90, 40), place)
    assert begun.wait(PATIENCE_S) and window.saving.progress is None
    qtbot.waitUntil(lambda: window.saving.progress is not None)
    progress = window.saving.progress
    qtbot.waitUntil(lambda: progress.value() == 500)
    assert all(text in progress.labelText() for text in ("slow.png", "90 × 40", "s left"))
    progress.canceled.emit()
    assert given_up.wait(PATIENCE_S)
    assert window.saving.progress is None and not window.saving.unfinished
    assert window.status.news == "The figure was cancelled." and not place.exists()


def test_figures_of_both_images_begin_as_the_screen_and_wait_for_both(
    qtbot, make_window, tmp_path, monkeypatch
):
    window, begun = make_window(), declined(monkeypatch)
    window.saving.ask()
    window.overlays.toggle("legend")
    window.overlays.toggle("scale_bar")
    window.image_error.is_wanted = True
    window.saving.ask()
    window.image_error.is_wanted = False
    choices = "both", "difference", "generator", "reference"
    for shown in choices[2:]:
        window.panes.shown = shown
        window.saving.ask()
    expected = [(which, which != "both", which != "both") for which in choices]
    assert [(one.which, one.legend, one.scale_bar) for one in begun] == expected
    window.panes.shown = "both"
    for which in choices[:3]:
        choice = FigureChoice(404, 200, (0, 0, 0), which=which)
        saved = saved_figure(qtbot, window, choice, tmp_path / f"{which}.png")
        assert (saved.width(), saved.height()) == (404, 200)
        colors = [saved.pixelColor(x, 100).getRgb()[:3] for x in (20, 202, 380)]
        black, white = (0, 0, 0), (255, 255, 255)
        if which == "difference":
            # A square of no difference, in grey, in the middle of black.
            assert colors[0] == colors[2] == black
            assert len(set(colors[1])) == 1 and colors[1] != black
        else:
            assert colors == [white, black if which == "both" else white, white]
    # A copy has the middle square of a wide image, which is what the generator's shows.
    wide = np.zeros((20, 60, 4), np.float32)
    wide[..., 3] = wide[:, 20:40] = 1
    monkeypatch.setattr(EnginePane, "whole", wide)
    action(window, "Copy image").trigger()
    qtbot.waitUntil(lambda: window.status.news == "Copied.")
    copied = QGuiApplication.clipboard().image()
    places = [(x, y) for x in (2, copied.width() - 3) for y in (2, copied.height() - 3)]
    assert {copied.pixelColor(*place).name() for place in places} == {"#ffffff"}


TURN = FigureChoice(64, 48, seconds=0.5, rate=8)


@pytest.fixture
def asked(monkeypatch):
    """Requests for pictures, which are as red as their azimuth."""
    requests = []

    def picture(self, request, _is_wanted):
        requests.append(request)
        self._wait_or_fail()
        pixels = request.quality.pixels
        image = np.full((pixels.height, pixels.width, 4), 255, np.uint8)
        image[..., :3] = round(255 * request.inputs.view.azimuth / 360), 0, 0
        return image

    monkeypatch.setattr(FakeEngine, "picture", picture)
    return requests


@pytest.fixture
def turning(window, asked):
    window.brightness.set(1.0)
    window.state.set_view(View(10.0, 20.0))
    return window


# imageio leaves its reader's pipes to the garbage collection.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_turntable_is_a_full_turn_of_the_size_length_and_rate_asked_for(
    qtbot, turning, asked, tmp_path
):
    window = turning
    for suffix in (".mp4", ".gif"):
        place = tmp_path / f"turn{suffix}"
        asked.clear()
        window.status.say("")
        window.state.set_view(View(10.0, 20.0))
        window.saving.draw(TURN, place)
        assert window.saving.progress is not None
        # The user may go on meanwhile.
        window.state.set_view(View(200.0, -50.0))
        qtbot.waitUntil(lambda: "Saved" in window.status.news)
        assert window.saving.progress is None and not window.saving.unfinished
        views = [request.inputs.view for request in asked if request.channel == "figure"]
        assert [view.azimuth for view in views] == pytest.approx([10.0, 280.0, 190.0, 100.0])
        assert {view.elevation for view in views} == {20.0}
        movie = np.stack([frame[..., :3] for frame in iio.imiter(place)])
        assert movie.shape == (4, 48, 64, 3)
        reds = movie[:, 20, 30, 0].astype(float)
        assert reds == pytest.approx([255 * a / 360 for a in (10, 280, 190, 100)], abs=12)
        meta = iio.immeta(place)
        # GIF counts in hundredths of a second.
        seconds = 1 / meta["fps"] if suffix == ".mp4" else meta["duration"] / 1000
        assert seconds == pytest.approx(0.125, abs=0.006)
    assert {path.name for path in tmp_path.iterdir()} == {"turn.mp4", "turn.gif"}


def test_what_cannot_be_drawn_or_written_is_reported_and_leaves_no_file(
    qtbot, turning, builders, tmp_path, monkeypatch
):
    window = turning
    gate = builders.references[-1].gate = threading.Semaphore(1)
    window.saving.draw(TURN, tmp_path / "turn.mp4")
    progress = window.saving.progress
    qtbot.waitUntil(lambda: progress.value() == 1)
    (cancel,) = progress.findChildren(QPushButton)
    assert cancel.text() == "Cancel"
    QTest.mouseClick(cancel, Qt.MouseButton.LeftButton)
    gate.release(10)
    qtbot.waitUntil(lambda: not window.saving.unfinished)
    assert "cancelled" in window.status.news
    assert not [*tmp_path.iterdir()]
    builders.references[-1].gate = None
    window.saving.draw(TURN, tmp_path / "missing" / "turn.gif")
    qtbot.waitUntil(lambda: "cannot be written" in window.notice.text)
    assert window.status.news == ""
    qtbot.waitUntil(lambda: not window.saving.unfinished)
    builders.references[-1].error = RenderError("It is broken; mend it.")
    window.saving.draw(TURN, tmp_path / "turn.gif")
    qtbot.waitUntil(lambda: "It is broken; mend it." in window.notice.text)
    qtbot.waitUntil(lambda: not window.saving.unfinished)
    builders.references[-1].error = None
    gate = builders.references[-1].gate = threading.Semaphore(0)
    window.saving.draw(TURN, tmp_path / "turn.gif")
    window.workspace.reference.choose(lighting="none")
    qtbot.waitUntil(lambda: "was cancelled" in window.notice.text)
    gate.release(10)
    qtbot.waitUntil(lambda: not window.saving.unfinished)
    assert not [*tmp_path.iterdir()] and window.saving.progress is None
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    # A window is closed with a movie only where that is meant.
    asked = []
    for answer, left in (("No", ["turn.mp4"]), ("Yes", [])):
        gate = builders.references[-1].gate = threading.Semaphore(1)
        window.status.say("")
        (tmp_path / answer).mkdir()
        window.saving.draw(TURN, tmp_path / answer / "turn.mp4")
        progress = window.saving.progress
        qtbot.waitUntil(lambda progress=progress: progress.value() == 1)

        def question(_parent, _title, text, answer=answer):
            asked.append(text)
            return QMessageBox.StandardButton[answer]

        monkeypatch.setattr(QMessageBox, "question", question)
        gate.release(10)
        assert window.close() is (answer == "Yes")
        if answer == "No":
            qtbot.waitUntil(lambda: "Saved" in window.status.news)
        assert [each.name for each in (tmp_path / answer).iterdir()] == left
    assert asked == 2 * ["turn.mp4 is being drawn.\nQuit and stop it?"]


def choose(dialog, box_name, text):
    box = getattr(dialog, box_name)
    row = next(i for i in range(box.count()) if text in box.itemText(i))
    box.setCurrentIndex(row)
    box.activated.emit(row)


def test_each_of_what_it_may_show_has_its_proportions(qtbot):
    sizes = {"reference": (960, 720), "generator": (128, 128), "both": (1454, 720)}
    sizes["difference"] = 720, 720
    dialog = FigureDialog(sizes, FigureChoice(0, 0, legend=True, scale_bar=True, which="both"))
    qtbot.addWidget(dialog)
    asked = []
    dialog.preview = asked.append
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
    assert dialog.legend_box.isHidden()
    assert dialog.movie_box.isHidden() and not dialog._no_movie.isHidden()
    choose(dialog, "which_box", "Both")
    assert not dialog.legend_box.isHidden() and not dialog.movie_box.isHidden()
    # Each choice is previewed.
    choose(dialog, "background_box", "White")
    assert asked[-1] == dialog.choice() and asked[-1].background == WHITE


@pytest.mark.parametrize("background", [None, (255, 255, 255), (3, 60, 90)])
def test_the_last_choice_comes_back(qtbot, background):
    # Of the screen's size, in its proportions, or in the user's own.
    for last, size in (((0, 0), (8192, 4096)), ((700, 0), (700, 350)), ((700, 900), (700, 900))):
        begin = FigureChoice(*last, background, True)
        dialog = FigureDialog({"reference": (20000, 10000)}, begin)
        qtbot.addWidget(dialog)
        assert dialog.choice() == FigureChoice(*size, background, True)
    assert not dialog.keep.isChecked()
    dialog.copy_button.click()
    assert dialog.result() == QDialog.DialogCode.Accepted and dialog.copies


def test_a_movie_has_even_sides_that_players_show_and_a_background(qtbot):
    begin = FigureChoice(0, 0, None, samples=16, seconds=2.0)
    dialog = FigureDialog({"reference": (20001, 10000)}, begin)
    qtbot.addWidget(dialog)
    dialog.movie_box.setChecked(True)
    assert dialog.choice() == replace(begin, width=4096, height=2048, background=(0, 0, 0))
    assert dialog.copy_button.isHidden()
    # Larger ones are 4096 wide, too.
    rows = [row for row in range(6) if not dialog.size_box.view().isRowHidden(row)]
    assert len({dialog.size_box.itemData(row) for row in rows}) == len(rows) == 5
    dialog.show()
    left = dialog.movie_box.x()
    dialog.rate_box.setValue(10)
    assert dialog.choice().frame_count == 20
    # 20 pictures of 8.4 megapixels take as much longer than the preview.
    dialog.show_preview(QImage(44, 22, QImage.Format.Format_RGB32), 2e-6)
    assert dialog._cost.text() == "about 89 min"
    dialog.seconds_box.setValue(4.0)
    assert dialog._cost.text() == "about 3 h"
    dialog.movie_box.setChecked(False)
    choose(dialog, "samples_box", "4")
    assert dialog._cost.text() == "347 × 173 mm at 300 dpi, about 67 s"
    assert dialog.choice().frame_count == 0 and not dialog.copy_button.isHidden()
    dialog.layout().activate()
    assert dialog.seconds_box.isHidden() and dialog.movie_box.x() == left
    dialog.width_box.setValue(8192)
    assert dialog.choice() == FigureChoice(8192, 4096, None, samples=4, rate=10)
    # The dialog says them, too.
    dialog.width_box.setValue(515)
    assert (dialog.width_box.value(), dialog.height_box.value()) == (515, 258)
    dialog.movie_box.setChecked(True)
    assert (dialog.width_box.value(), dialog.height_box.value()) == (514, 256)


SCALE = Scale((0.577, 0.577, 0.577), 50.0, "mm", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
INPUTS = SceneInputs.of(View(), make_tf())
BLACK, WHITE = (0, 0, 0), (255, 255, 255)


def plain(level, height, width):
    image = np.full((height, width, 4), level, np.float32)
    image[..., 3] = 1.0
    return image


def made(choice, reduced=None, **images):
    subject = Subject("K", SCALE, wipe=0.25)
    drawn = {name: (image, 1.0) for name, image in images.items()}
    return pixels_of(figure(choice, drawn, INPUTS, subject, reduced=reduced)).astype(int)


@pytest.mark.parametrize(
    ("size", "text"),
    # 8 points at 300 dpi and on a page of 180 mm, or less in small images.
    [((1000, 500), 500 / 26), ((500, 1000), 500 / 26), ((1400, 1000), 33), ((4252, 2000), 67)],
)
def test_the_scale_bar_is_as_long_as_the_scale_says_and_its_text_as_high_as_in_print(size, text):
    width, height = size
    image = plain(0.0, height, width)
    without = made(FigureChoice(width, height, BLACK), reference=image)
    shown = made(FigureChoice(width, height, BLACK, scale_bar=True), reference=image)
    assert (without == 0).all()
    changed = np.abs(shown - without).max(axis=-1) > 128
    rows, columns = np.nonzero(changed)
    assert rows.min() > height - 3.5 * text and columns.max() < width / 2
    font = QFont()
    font.setPixelSize(round(text))
    drawn = changed.any(axis=1)[rows.min() :]
    of_text = QFontMetricsF(font).tightBoundingRect("50 mm").height()
    assert np.argmin(drawn) == pytest.approx(of_text, abs=2)
    bar = SCALE.bar(INPUTS.view)
    length = bar.share * min(size)
    # The longest row of pixels is the bar.
    longest = changed.sum(axis=1).max()
    assert longest == pytest.approx(length, abs=max(4, text / 10))


def test_a_narrow_image_has_a_short_legend():
    choice, black = FigureChoice(300, 600, BLACK, legend=True), plain(0.0, 600, 300)
    rows = np.flatnonzero(made(choice, reference=black).any(axis=(1, 2)))
    assert 600 - 0.6 * 300 < rows.min() < 600 - 0.4 * 300


def test_a_preview_is_the_figure_at_a_smaller_size():
    choice = FigureChoice(2000, 400, BLACK, True, True, "a_b")
    images = {"reference": plain(0.2, 400, 990), "b": plain(0.5, 400, 990)}
    whole, small = made(choice, **images), made(choice, (400, 80), **images)
    means = whole.reshape(80, 5, 400, 5, 3).mean(axis=(1, 3))
    assert np.abs(means - small).mean() < 1


@pytest.mark.parametrize("ground", [BLACK, None])
def test_a_wiped_figure_has_a_left_of_the_line_and_b_right_of_it(ground):
    a, b = plain(0.1, 300, 400), 0.6 * plain(0.5, 300, 400)
    choice = FigureChoice(400, 300, ground, legend=True, which="wiped", is_beside=False)
    drawn = {"reference": (a, 1.0), "b": (b, 1.0)}
    shown = figure(choice, drawn, INPUTS, Subject("K", SCALE, wipe=0.25))
    for x, image in ((90, a), (110, b)):
        pixel = shown.pixelColor(x, 150)
        levels = [pixel.redF() * pixel.alphaF(), pixel.alphaF()]
        expected = [image[0, 0, 0], image[0, 0, 3] if ground is None else 1]
        assert levels == pytest.approx(expected, abs=0.01)
    # The line, and the legend of both.
    assert shown.pixelColor(100, 150).red() > 130
    assert len({shown.pixel(x, 250) for x in range(250, 400)}) > 10


@pytest.mark.parametrize("which", ["generator", "b"])
def test_the_difference_stands_out_where_it_is_largest_and_is_white_on_white(which):
    truth = plain(0.5, 300, 300)
    truth[:50] = 0.0
    drawn = truth.copy()
    drawn[100:150, 100:150, :3] += 0.3
    hues = []
    for ground, level in ((BLACK, 0), (WHITE, 255), (None, 255)):
        compared = Comparison.of({which: (drawn, 1.0), "reference": (truth, 1.0)})
        choice = FigureChoice(300, 300, ground, True, True, "difference")
        picture = figure(choice, {}, INPUTS, Subject("K", SCALE), compared)
        pixels = pixels_of(picture).astype(int)
        inside, outside = pixels[125, 125], pixels[60, 60]
        np.testing.assert_array_equal(pixels[20, 200], 3 * [level])
        assert abs(inside - level).sum() > abs(outside - level).sum() + 60
        assert np.abs(pixels[240:, 150:] - outside).max() > 100
        hues.append(picture.pixelColor(125, 125).hue())
    assert max(hues) - min(hues) <= 3


@pytest.mark.parametrize("wide", [60, 300])
def test_the_difference_of_a_and_b_is_that_of_what_they_show(wide):
    a, b = (np.zeros((60, wide, 3), np.float32) for _ in range(2))
    a[10:30, 10:30], b[20:40, 10:30] = 0.5, 0.5
    # A third of what either shows is in both.
    assert Comparison(b, a, is_of_b=True).error == pytest.approx(0.5 * (2 / 3) ** 0.5)
    assert Comparison(b, a).error == pytest.approx(0.5 * (400 / (60 * wide)) ** 0.5)
    assert Comparison(0 * a, 0 * a, is_of_b=True).error == 0
