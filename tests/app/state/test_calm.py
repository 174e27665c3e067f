"""What is shown beside the images waits its turn while something moves, and nothing is lost."""

from __future__ import annotations

import itertools
import time
from dataclasses import replace

from PySide6.QtCore import QObject
from pytestqt.qtbot import QtBot

from app.state.calm import INTERVAL_S
from app.state.viewer_state import ViewerState


def test_while_something_moves_refreshes_are_few_and_show_the_newest(qtbot: QtBot) -> None:
    parent = QObject()
    state = ViewerState(parent)
    shown: list[float] = []
    times: list[float] = []

    def note() -> None:
        times.append(time.monotonic())

    state.inputsChanged.connect(state.calm.soon(lambda: shown.append(state.view.azimuth)))
    state.inputsChanged.connect(state.calm.soon(note))

    def turn() -> bool:
        state.move_view(replace(state.view, azimuth=state.view.azimuth + 0.01))
        return len(shown) >= 4

    qtbot.waitUntil(turn)
    assert shown == sorted(shown) and len(times) == 4
    assert all(b - a > 0.9 * INTERVAL_S for a, b in itertools.pairwise(times))
    turn()
    state.finish_view()
    assert shown[-1] == state.view.azimuth


def test_at_rest_a_refresh_is_at_once_and_the_last_of_a_name_counts(qtbot: QtBot) -> None:
    parent = QObject()
    state = ViewerState(parent)
    said: list[str] = []
    refresh = state.calm.soon(lambda: said.append("at rest"))
    refresh("an argument of a signal")
    assert said == ["at rest"]
    state.move_view(replace(state.view, azimuth=1.0))
    for word in ("first", "second"):
        state.calm.ask(said.append, lambda word=word: said.append(word))
    assert said == ["at rest"]
    state.finish_view()
    assert said == ["at rest", "second"]
