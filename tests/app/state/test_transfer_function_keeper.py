from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QObject
from pytestqt.qtbot import QtBot
from ramp import make_tf

from app.state import delayed_writer
from app.state.transfer_function_keeper import TransferFunctionKeeper, TransferFunctionStore
from model.errors import TransferFunctionError
from model.scene.transfer_function import TransferFunction


class Watched(TransferFunctionStore):
    """Remembers in which threads it was written to, and fails when told to."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.threads: list[threading.Thread] = []
        self.fails = False

    def save(self, fingerprint: str, transfer_function: TransferFunction) -> None:
        self.threads.append(threading.current_thread())
        if self.fails:
            raise TransferFunctionError("The disk is full.")
        super().save(fingerprint, transfer_function)


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Watched:
    monkeypatch.setattr(delayed_writer, "PAUSE_MS", 20)
    return Watched(tmp_path)


@pytest.fixture
def keeper(qapp: QObject, store: Watched) -> Iterator[TransferFunctionKeeper]:
    parent = QObject()
    keeper = TransferFunctionKeeper(store, parent)
    yield keeper
    keeper.finish()
    parent.deleteLater()


def test_edits_in_a_row_are_written_once_and_elsewhere(
    qtbot: QtBot, keeper: TransferFunctionKeeper, store: Watched
) -> None:
    for mean in (120.0, 130.0, 140.0):
        keeper.keep("a", make_tf(mean))
    keeper.keep("b", make_tf(150.0))
    assert store.threads == []
    qtbot.waitUntil(lambda: len(store.threads) == 2)
    qtbot.waitUntil(lambda: not keeper._writer.is_writing)
    assert threading.current_thread() not in store.threads
    assert store.load("a") == make_tf(140.0)
    assert store.load("b") == make_tf(150.0)


def test_what_is_loaded_is_the_newest(keeper: TransferFunctionKeeper) -> None:
    keeper.keep("a", make_tf(120.0))
    assert keeper.load("a") == make_tf(120.0)
    assert keeper.load("b") is None


def test_a_disk_that_fails_for_thread_and_end_is_told_once(
    qtbot: QtBot, keeper: TransferFunctionKeeper, store: Watched
) -> None:
    store.fails = True
    told: list[str] = []
    keeper.problem.connect(told.append)
    keeper.keep("a", make_tf(120.0))
    qtbot.waitUntil(lambda: len(store.threads) == 1)
    keeper.keep("b", make_tf(130.0))
    keeper.finish()
    qtbot.waitUntil(lambda: not keeper._writer.is_writing)
    assert told == ["The disk is full."]
