import threading

import imageio.v3 as iio
import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMessageBox, QPushButton
from window_fakes import FakeEngine

from app.window.figure import FigureChoice
from model.errors import RenderError
from model.scene.view import View

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
def window(make_window, asked):
    window = make_window(model=None)
    window.brightness.set(1.0)
    window.state.set_view(View(10.0, 20.0))
    return window


def frames_of(path):
    return np.stack([frame[..., :3] for frame in iio.imiter(path)])


# imageio leaves its reader's pipes to the garbage collection.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_turntable_is_a_full_turn_of_the_size_length_and_rate_asked_for(
    qtbot, window, asked, tmp_path
):
    for suffix in (".mp4", ".gif"):
        place = tmp_path / f"turn{suffix}"
        asked.clear()
        window.status.say("")
        window.state.set_view(View(10.0, 20.0))
        window.saving.draw(TURN, place)
        assert window.saving.progress is not None
        # The user may go on meanwhile.
        window.state.set_view(View(200.0, -50.0))
        qtbot.waitUntil(lambda: "Saved" in window.status.news, timeout=20_000)
        assert window.saving.progress is None and not window.saving.unfinished
        views = [request.inputs.view for request in asked if request.channel == "figure"]
        assert [view.azimuth for view in views] == pytest.approx([10.0, 280.0, 190.0, 100.0])
        assert {view.elevation for view in views} == {20.0}
        movie = frames_of(place)
        assert movie.shape == (4, 48, 64, 3)
        reds = movie[:, 20, 30, 0].astype(float)
        assert reds == pytest.approx([255 * a / 360 for a in (10, 280, 190, 100)], abs=12)
        meta = iio.immeta(place)
        # GIF counts in hundredths of a second.
        seconds = 1 / meta["fps"] if suffix == ".mp4" else meta["duration"] / 1000
        assert seconds == pytest.approx(0.125, abs=0.006)
    assert {path.name for path in tmp_path.iterdir()} == {"turn.mp4", "turn.gif"}


def test_what_cannot_be_drawn_or_written_is_told_and_leaves_no_file(
    qtbot, window, builders, tmp_path, monkeypatch
):
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
    qtbot.waitUntil(lambda: "cannot be written" in window.notice.text, timeout=20_000)
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
    gate = builders.references[-1].gate = threading.Semaphore(0)
    window.saving.draw(FigureChoice(20, 20), tmp_path / "figure.png")
    assert window.saving.unfinished == "figure.png is being drawn"
    window.notice.clear()
    window.workspace.reference.choose(lighting="direct")
    qtbot.waitUntil(lambda: "was cancelled" in window.notice.text)
    gate.release(10)
    assert not window.saving.unfinished
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
            qtbot.waitUntil(lambda: "Saved" in window.status.news, timeout=20_000)
        assert [each.name for each in (tmp_path / answer).iterdir()] == left
    assert asked == 2 * ["turn.mp4 is being drawn.\nQuit and stop it?"]
