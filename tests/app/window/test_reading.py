"""Reading in the window: progress in the status line, and a button that cancels it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from ramp import make_volume
from window_fakes import PATIENCE_S, FakeBuilders

from app.window.main_window import MainWindow
from model.scene.volume import Volume
from model.volume_files.progress import counted

WindowMaker = Callable[..., MainWindow]


def test_a_long_reading_is_told_and_cancelled(
    qtbot: QtBot,
    make_window: WindowMaker,
    builders: FakeBuilders,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    window = make_window(model=None)
    read = window.workspace.reading._opening._read_volume
    go_on, ended = threading.Event(), threading.Event()

    def read_slowly(path: Path) -> Volume:
        try:
            for number in counted("slices read", range(500)):
                if number == 120:
                    assert go_on.wait(PATIENCE_S)
            return make_volume("slow")
        finally:
            ended.set()

    window.workspace.reading._opening._read_volume = read_slowly
    window.opening._slow.setInterval(1)
    window.opening.open_volume(Path("series"))
    qtbot.waitUntil(lambda: "of 500 slices read" in window.status.news)
    qtbot.waitUntil(lambda: "series is being read" in window.notice.text)
    (cancel,) = (
        b
        for b in window.notice.findChildren(QPushButton)
        if b.text() == "Cancel" and not b.isHidden()
    )
    cancel.click()
    go_on.set()
    assert ended.wait(PATIENCE_S)
    assert "cancelled" in window.notice.text
    assert "being read" not in window.notice.text
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert window.workspace.opened is not None
    assert window.workspace.opened.volume is not None
    assert window.windowTitle().startswith("ramp")
    window.workspace.reading._opening._read_volume = read
