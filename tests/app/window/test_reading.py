"""Reading in the window: progress in the status line, and a button that cancels it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from ramp import make_volume
from window_fakes import PATIENCE_S, FakeBuilders

from app.engines.requests import Engine
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
    work = window.workspace.reference
    said: list[str] = []
    start = work._reference.start

    def start_and_note(build: Callable[[], Engine], text: str, held: bool = False) -> None:
        said.append(text)
        start(build, text, held)

    monkeypatch.setattr(work._reference, "start", start_and_note)
    for is_compiled in (False, True):
        compiled = replace(work._builders, is_compiled=lambda is_compiled=is_compiled: is_compiled)
        monkeypatch.setattr(work, "_builders", compiled)
        name = f"other {is_compiled}"
        builders.volumes[name] = make_volume(name, 300.0 + is_compiled)
        said.clear()
        with qtbot.waitSignal(window.workspace.volumeStarted):
            window.workspace.reading.open(Path(name))
        assert said[0].startswith("Preparing the volume")
        assert ("The first time" in said[0]) is not is_compiled
