import threading

import numpy as np
from PySide6.QtGui import QGuiApplication, QImage
from PySide6.QtWidgets import QDialog, QFileDialog
from window_fakes import PATIENCE_S, FakeEngine

from app.engines.requests import SupersededError
from app.window.figure import FigureChoice
from app.window.figure_dialog import FigureDialog


def test_figures_are_saved_and_copied(qtbot, window, builders, tmp_path, monkeypatch):
    for background in (None, (0, 0, 0)):
        place = tmp_path / f"{background}.png"
        window.saving.draw(FigureChoice(90, 40, background), place)
        qtbot.waitUntil(place.exists)
        qtbot.waitUntil(lambda: "Saved" in window.status.news)
        saved = QImage(str(place))
        assert (saved.width(), saved.height()) == (90, 40)
        assert saved.pixelColor(5, 5).getRgb() == (255, 255, 255, 255)
        assert saved.hasAlphaChannel() == (background is None)
        assert not saved.text("Error")
    for estimated, said in (
        (float("inf"), ""),
        (0.0042, "Estimated RMSE of the ground truth's colours, from 0 to 1: 0.0042."),
    ):
        builders.references[-1].image_error = estimated
        place = tmp_path / f"{estimated}.png"
        window.saving.draw(FigureChoice(90, 40), place)
        qtbot.waitUntil(place.exists)
        text = QImage(str(place)).text("Error")
        assert text.startswith(said) and bool(text) == bool(said)
    choice = FigureChoice(300, 200, (0, 0, 0), legend=True)
    window.saving.draw(choice, None)
    qtbot.waitUntil(lambda: window.status.news == "Copied.")
    copied = QGuiApplication.clipboard().image()
    assert (copied.width(), copied.height()) == (300, 200)
    colors = {copied.pixel(x, y) for x in range(200, 300, 3) for y in range(60, 200, 3)}
    assert len(colors) > 5
    assert len({copied.pixel(x, y) for x in range(0, 90, 3) for y in range(0, 60, 3)}) == 1
    place = tmp_path / "missing" / "picture.png"
    window.saving.draw(FigureChoice(20, 20), place)
    qtbot.waitUntil(lambda: "picture.png" in window.notice.text)
    place = str(tmp_path / "wide")
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (place, ""))
    monkeypatch.setattr(FigureDialog, "exec", lambda _dialog: QDialog.DialogCode.Accepted)
    window.saving.ask()
    qtbot.waitUntil((tmp_path / "wide.png").exists)
    qtbot.waitUntil(lambda: not window.saving.unfinished)
    # One is offered in its final size where there is an image.
    monkeypatch.undo()
    window.reference.canvas.show_image(None)
    window.saving.ask()
    assert "no image" in window.notice.text
    offered = []

    def no(dialog):
        offered.append((dialog.choice().width, dialog.choice().height))
        return QDialog.DialogCode.Rejected

    monkeypatch.setattr(FigureDialog, "exec", no)
    window.reference.canvas.show_image(QImage(30, 30, QImage.Format.Format_RGB888))
    window.saving.ask()
    whole = window.reference.canvas.picture_rect
    assert offered == [(whole.width(), whole.height())]
    assert "generator" not in window.saving.sizes()


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
    place = tmp_path / "picture.png"
    window.saving.draw(FigureChoice(90, 40, samples=256), place)
    qtbot.waitUntil(place.exists)
    assert asked == [256]
    qtbot.waitUntil(lambda: "Saved" in window.status.news)
    assert QImage(str(place)).text("Light") == "Path-traced, 256 samples of each pixel"
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
    window = make_window()
    begun = []

    def no(dialog):
        begun.append(dialog.choice())
        return QDialog.DialogCode.Rejected

    monkeypatch.setattr(FigureDialog, "exec", no)
    window.saving.ask()
    window.overlays.toggle("legend")
    window.overlays.toggle("scale_bar")
    window.image_error.set_wanted(True)
    window.saving.ask()
    window.image_error.set_wanted(False)
    for shown in ("generator", "reference"):
        window.panes.show_images(shown)
        window.saving.ask()
    assert [(one.which, one.legend, one.scale_bar) for one in begun] == [
        ("both", False, False),
        ("difference", True, True),
        ("generator", True, True),
        ("reference", True, True),
    ]
    window.panes.show_images("both")
    choices = ("both", "difference", "generator")
    for which in choices:
        place = tmp_path / f"{which}.png"
        window.saving.draw(FigureChoice(404, 200, (0, 0, 0), which=which), place)
        qtbot.waitUntil(place.exists)
        saved = QImage(str(place))
        assert (saved.width(), saved.height()) == (404, 200)
        colors = [saved.pixelColor(x, 100).getRgb()[:3] for x in (20, 202, 380)]
        black, white = (0, 0, 0), (255, 255, 255)
        if which == "difference":
            # A square of no difference, in grey, in the middle of black.
            assert colors[0] == colors[2] == black
            assert len(set(colors[1])) == 1 and colors[1] != black
        else:
            assert colors == [white, black if which == "both" else white, white]
