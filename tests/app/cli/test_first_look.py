"""What the window opens for who names no volume."""

from __future__ import annotations

from app.cli import commands, run
from app.state.window_start import WindowStart
from model.volume_files.shipped import DEFAULT_VOLUME, SCAN


def test_it_is_the_scan_whatever_else_is_asked_for(monkeypatch):
    starts: list[WindowStart] = []

    def note(start: WindowStart, *_: object) -> int:
        starts.append(start)
        return 0

    monkeypatch.setattr(commands, "open_window", note)
    for words in ([], ["--renderer", "vtk"], [str(DEFAULT_VOLUME)]):
        assert run(words) == 0
    assert [start.volume for start in starts] == [SCAN, SCAN, DEFAULT_VOLUME]
