from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton, QToolButton
from pytestqt.qtbot import QtBot

from app.engines.engines import ReferenceSettings
from app.state.training_run import TrainingRun
from app.window.training_card import TrainingCard

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
def bar(qtbot: QtBot, run: FakeRun) -> TrainingCard:
    bar = TrainingCard(run)
    qtbot.addWidget(bar)
    bar.set_offered(True)
    return bar


def visible(bar: TrainingCard) -> list[str]:
    kinds = [*bar.findChildren(QPushButton), *bar.findChildren(QToolButton)]
    return [b.text() or b.accessibleName() for b in kinds if b.isVisibleTo(bar)]


def press(qtbot: QtBot, button: QPushButton | QToolButton) -> None:
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)


def test_a_volume_without_a_model_is_offered_one(qtbot: QtBot, bar: TrainingCard) -> None:
    # In the menus, not over the image.
    assert bar.isHidden() and bar.train.isEnabled()
    assert "31 min" in bar.train.text()
    with qtbot.waitSignal(bar.trainRequested):
        bar.train.trigger()
    bar.set_offered(False)
    assert not bar.train.isEnabled()


def test_the_entry_says_where_a_model_learns_another_light(bar: TrainingCard) -> None:
    for lighting in ("none", "direct"):
        bar.set_settings(ReferenceSettings(lighting))
        assert "light" not in bar.train.text()
    bar.set_settings(ReferenceSettings("soft"))
    assert "under direct light" in bar.train.text()


def test_a_training_stays_in_sight_and_can_be_cancelled(
    qtbot: QtBot, bar: TrainingCard, run: FakeRun
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
    assert bar.train.isEnabled()
    run.progressed.emit(0.0, "preparing")
    assert bar.cancel.isEnabled()
    # One at a time.
    assert not bar.train.isEnabled()


def test_a_trained_model_is_shown_when_asked(qtbot: QtBot, bar: TrainingCard, run: FakeRun) -> None:
    run.finished.emit(Path("model"))
    assert visible(bar) == ["Use", "Dismiss"]
    assert bar.text == f"Trained on engine. {VERDICT}"
    # Another volume, with a model, is open by now.
    bar.set_offered(False)
    assert not bar.isHidden()
    with qtbot.waitSignal(bar.trained) as shown:
        press(qtbot, bar.show_model)
    assert shown.args == [Path("model")]
    assert bar.isHidden()


def test_what_has_failed_is_said_and_can_be_tried_again(
    qtbot: QtBot, bar: TrainingCard, run: FakeRun
) -> None:
    sentence = "/data/engine.nrrd: the file is truncated; copy it again. " * 5
    run.failed.emit(sentence)
    assert visible(bar) == ["Train…", "Dismiss"]
    assert bar.text == sentence
    bar.set_offered(False)
    assert visible(bar) == ["Dismiss"]
    press(qtbot, bar.dismiss)
    assert bar.isHidden()


def test_a_long_sentence_is_shown_as_a_whole(qtbot: QtBot, bar: TrainingCard, run: FakeRun) -> None:
    run.finished.emit(Path("model"))
    bar.resize(bar.sizeHint())
    one = bar.height()
    run.failed.emit("The file is truncated; copy it again. " * 6)
    assert bar.sizeHint().height() > one
    assert bar.property("tone") == "error"
