"""What the window shows first to who names nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from app.cli import window
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
