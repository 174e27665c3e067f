"""The first look of the window, for who names nothing."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.cli import run, window
from app.state.window_start import WindowStart
from model.volume_files.shipped import DEFAULT_VOLUME, SCAN

START = WindowStart(DEFAULT_VOLUME)


def test_it_is_the_scan_in_path_traced_light() -> None:
    assert window.first_look(START) == replace(START, volume=SCAN, proposed="path")
    # A light that was asked for is kept.
    asked = replace(START, lighting="direct")
    assert window.first_look(asked) is asked


def test_who_names_anything_sees_that(monkeypatch: pytest.MonkeyPatch) -> None:
    starts: list[WindowStart] = []

    def note(start: WindowStart, *_: object) -> int:
        starts.append(start)
        return 0

    monkeypatch.setattr(window, "open_window", note)
    for words in ([], ["--renderer", "vtk"], [str(DEFAULT_VOLUME)]):
        assert run(words) == 0
    assert [start.proposed for start in starts] == ["path", None, None]
    assert [start.volume for start in starts] == [SCAN, DEFAULT_VOLUME, DEFAULT_VOLUME]
