"""The window on the screens that people have, each scale in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

SCRIPT = Path(__file__).with_name("sized_window.py")

SCREENS: dict[str, tuple[tuple[int, int], ...]] = {
    "1": (
        (800, 450),
        (1000, 640),
        (1093, 614),
        (1280, 720),
        (1366, 768),
        (1440, 900),
        (1920, 1080),
    ),
    "1.5": ((853, 450), (1000, 640), (1280, 720)),
    "2": ((800, 450), (960, 540), (1000, 640)),
}
"""Windows in logical pixels by the screen's scale; among them 1366 x 768 at 125 %, 1920 x 1080 at
150 and at 200 %, 1280 x 720 at 150 % below a task bar, and 1600 x 900 at 200 %."""


@cache
def windows(scale: str) -> list[dict[str, Any]]:
    folders = [*SCRIPT.parents[1:3], SCRIPT.parents[3]]
    sizes = [f"{width}x{height}" for width, height in SCREENS[scale]]
    done = subprocess.run(
        [sys.executable, str(SCRIPT), *sizes],
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join(map(str, folders)),
            "QT_QPA_PLATFORM": "offscreen",
            "QT_SCALE_FACTOR": scale,
        },
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    "scale", ["1", *(pytest.param(scale, marks=pytest.mark.slow) for scale in ("1.5", "2"))]
)
def test_everything_has_room_and_nothing_is_cut(scale: str) -> None:
    found = windows(scale)
    assert [tuple(each["wanted"]) for each in found] == list(SCREENS[scale])
    for each in found:
        assert each["ratio"] == pytest.approx(float(scale))
        for name in ("plain", "floating", "browsing"):
            seen = each[name]
            assert seen["size"] == each["wanted"], name
            assert seen["least"][0] <= 1000 and seen["least"][1] <= 640, name
            assert seen["cut"] == [], name
        # What floats moves nothing.
        assert each["plain"]["image"] == each["floating"]["image"]


@pytest.mark.parametrize(
    ("size", "image", "square"),
    [((1440, 900), 520, 470), ((1000, 640), 350, 300)],
)
def test_the_images_have_the_room(size: tuple[int, int], image: int, square: int) -> None:
    (each,) = [each for each in windows("1") if tuple(each["wanted"]) == size]
    assert each["plain"]["image"][1] >= image
    assert min(each["browsing"]["squares"]) >= square
    assert each["browsing"]["image"][0] >= 220
