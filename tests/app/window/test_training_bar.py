from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton, QToolButton
from pytestqt.qtbot import QtBot

from app.engines.engines import ReferenceSettings
from app.state.training_run import TrainingRun
from app.window.training_bar import HEIGHT, TrainingBar

VERDICT = "The model is 1.2 times as slow as the ray caster. With the volume at hand, it serves."


class FakeRun(TrainingRun):
    """Says what the test says."""

    cancels = 0

    @property
    def volume_name(self) -> str:
        return "engine"

    @property
    def verdict(self) -> str:
        return VERDICT

    def cancel(self) -> None:
        self.cancels += 1


@pytest.fixture
def run() -> FakeRun:
    return FakeRun()


@pytest.fixture
def bar(qtbot: QtBot, run: FakeRun) -> TrainingBar:
    bar = TrainingBar(run)
    qtbot.addWidget(bar)
    bar.resize(1200, HEIGHT)
    bar.set_offered(True)
    return bar


def visible(bar: TrainingBar) -> list[str]:
    kinds = [*bar.findChildren(QPushButton), *bar.findChildren(QToolButton)]
    return [b.text().partition(" ")[0] for b in kinds if b.isVisibleTo(bar)]


def press(qtbot: QtBot, button: QPushButton | QToolButton) -> None:
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)


def test_a_volume_without_a_model_is_offered_one(qtbot: QtBot, bar: TrainingBar) -> None:
    assert not bar.isHidden()
    assert bar.height() == HEIGHT
    assert visible(bar) == ["Train", "Open"]
    assert "No model" in bar.text and "2 min" in bar.train.text()
    with qtbot.waitSignal(bar.trainRequested):
        press(qtbot, bar.train)
    with qtbot.waitSignal(bar.openRequested):
        press(qtbot, bar.open)
    bar.set_offered(False)
    assert bar.isHidden()


def test_the_button_says_where_a_model_learns_another_light(bar: TrainingBar) -> None:
    for lighting in ("none", "direct"):
        bar.set_settings(ReferenceSettings(lighting))
        assert "light" not in bar.train.text()
    bar.set_settings(ReferenceSettings("global"))
    assert "under direct light" in bar.train.text()


def test_a_training_stays_in_sight_and_can_be_cancelled(
    qtbot: QtBot, bar: TrainingBar, run: FakeRun
) -> None:
    run.progressed.emit(0.25, "training, about 50 s left")
    bar.set_offered(False)
    assert not bar.isHidden()
    assert visible(bar) == ["Cancel"]
    assert bar.text == "Model of engine: training, about 50 s left"
    assert bar._progress.value() == 0.25 * bar._progress.maximum()
    press(qtbot, bar.cancel)
    assert run.cancels == 1
    run.progressed.emit(0.25, "stopping")
    press(qtbot, bar.cancel)
    assert run.cancels == 1
    run.cancelled.emit()
    assert bar.isHidden()
    bar.set_offered(True)
    assert visible(bar) == ["Train", "Open"]
    run.progressed.emit(0.0, "preparing")
    assert bar.cancel.isEnabled()


def test_a_trained_model_is_shown_when_asked(qtbot: QtBot, bar: TrainingBar, run: FakeRun) -> None:
    run.finished.emit(Path("model"))
    assert visible(bar) == ["Show", "✕"]
    assert bar.text == f"Trained on engine. {VERDICT}"
    # Another volume, with a model, is open by now.
    bar.set_offered(False)
    assert not bar.isHidden()
    with qtbot.waitSignal(bar.trained) as shown:
        press(qtbot, bar.show_model)
    assert shown.args == [Path("model")]
    assert bar.isHidden()


def test_what_has_failed_is_said_and_can_be_tried_again(
    qtbot: QtBot, bar: TrainingBar, run: FakeRun
) -> None:
    sentence = "/data/engine.nrrd: the file is truncated; copy it again. " * 5
    run.failed.emit(sentence)
    assert visible(bar) == ["Train", "Open", "✕"]
    assert bar.text == sentence
    bar.set_offered(False)
    assert visible(bar) == ["✕"]
    press(qtbot, bar.dismiss)
    assert bar.isHidden()


def test_what_has_no_room_is_in_the_tooltip(qtbot: QtBot, bar: TrainingBar, run: FakeRun) -> None:
    bar.show()
    run.finished.emit(Path("model"))
    bar.resize(500, HEIGHT)
    assert bar.width() == 500
    assert bar._label.text().endswith("…")
    assert bar._label.toolTip() == bar.text
    bar.resize(3000, HEIGHT)
    assert (bar._label.text(), bar._label.toolTip()) == (bar.text, "")
