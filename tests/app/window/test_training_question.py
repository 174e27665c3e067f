from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from app.state.training_order import training_order
from app.state.training_pace import TrainingPace
from app.window.main_window import MainWindow
from app.window.training_question import TrainingQuestion

PROGRAM = """
import json, sys, time
assert "--pace" in sys.argv and "--json-lines" in sys.argv
print("for people")
for line in ({"kind": "execution"}, {"kind": "pace", "samples_per_second": 37.77}):
    print(json.dumps(line), flush=True)
"""


def pace_of(tmp_path: Path, text: str) -> TrainingPace:
    path = tmp_path / "program.py"
    path.write_text(text)
    return TrainingPace(command=(sys.executable, "-I", "-S", str(path)))


def test_the_question_says_the_measured_pace(qtbot: QtBot, tmp_path: Path) -> None:
    pace, parent = pace_of(tmp_path, PROGRAM), QWidget()
    qtbot.addWidget(parent)
    question = TrainingQuestion("bone", pace, parent)
    assert "being measured" in question.informativeText()
    with qtbot.waitSignal(pace.found, timeout=60_000):
        pace.measure(training_order(tmp_path / "bone.nrrd", 30.0))
    said = question.informativeText()
    assert "37.8 samples a second" in said and "from 68,000 in 30 minutes" in said
    assert "being measured" not in said
    pace.cancel()


def test_a_slow_start_counts(qtbot: QtBot, tmp_path: Path) -> None:
    pace, parent = TrainingPace(), QWidget()
    qtbot.addWidget(parent)
    question = TrainingQuestion("bone", pace, parent)
    pace.found.emit(2.0, 300.0)
    assert "about 35 minutes" in question.informativeText()


def test_an_answer_ends_the_measurement(qtbot: QtBot, tmp_path: Path) -> None:
    pace, parent = pace_of(tmp_path, "import time\nwhile True: time.sleep(.01)"), QWidget()
    qtbot.addWidget(parent)
    pace.measure(training_order(tmp_path / "bone.nrrd", 30.0))
    question = TrainingQuestion("bone", pace, parent)
    assert pace.is_running
    question.reject()
    assert not pace.is_running


def test_the_window_asks_for_the_open_volume(
    qtbot: QtBot, make_window: Callable[..., MainWindow], monkeypatch: pytest.MonkeyPatch
) -> None:
    window = make_window(model=None)
    asked: list[tuple[str, ...]] = []
    monkeypatch.setattr(window.training_start.pace, "measure", asked.append)
    started: list[Path] = []
    monkeypatch.setattr(window.training, "start", lambda path, **_: started.append(path))
    window.training_card.train.trigger()
    (question,) = window.findChildren(TrainingQuestion)
    assert asked[0][:3] == ("train", "--volume", str(Path("ramp").absolute()))
    assert started == []
    question.train.click()
    assert started == [Path("ramp")]
