"""The first look of the window, for who names nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from app.cli import run, window
from app.state.window_start import WindowStart
from model.volume_files.shipped import DEFAULT_VOLUME, SCAN

START = WindowStart(DEFAULT_VOLUME)


@pytest.mark.parametrize("seconds", [0.05, window.SOON_S])
def test_the_scan_is_path_traced_where_that_is_fast(
    monkeypatch: pytest.MonkeyPatch, seconds: float
) -> None:
    monkeypatch.setattr(window, "path_traced_seconds", lambda: seconds)
    assert window.first_look(START) == replace(START, volume=SCAN, proposed="path")
    # A light that was asked for is kept.
    asked = replace(START, lighting="direct")
    assert window.first_look(asked) is asked


@pytest.mark.parametrize("seconds", [0.26, math.inf])
def test_elsewhere_it_is_the_default_volume(
    monkeypatch: pytest.MonkeyPatch, seconds: float
) -> None:
    monkeypatch.setattr(window, "path_traced_seconds", lambda: seconds)
    assert window.first_look(START) is START


def test_who_names_anything_sees_that(monkeypatch: pytest.MonkeyPatch) -> None:
    starts: list[WindowStart] = []

    def note(start: WindowStart, *_: object) -> int:
        starts.append(start)
        return 0

    monkeypatch.setattr(window, "open_window", note)
    monkeypatch.setattr(window, "path_traced_seconds", lambda: 0.1)
    for words in ([], ["--renderer", "vtk"], [str(DEFAULT_VOLUME)]):
        assert run(words) == 0
    assert [start.proposed for start in starts] == ["path", None, None]
    assert [start.volume for start in starts] == [SCAN, DEFAULT_VOLUME, DEFAULT_VOLUME]
