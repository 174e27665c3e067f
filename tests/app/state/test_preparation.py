from __future__ import annotations

import sys
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from app.state import preparation
from app.state.preparation import Preparation
from model import kernel_cache
from model.kernel_cache import KernelGroup

IMAGES = KernelGroup("uint8", "direct", "images")
QUESTIONS = KernelGroup("uint8", "direct", "questions")

KEEPS = "import pathlib, sys; pathlib.Path(sys.argv[1], '-'.join(sys.argv[2:])).touch()"
FAILS = "import sys; sys.exit(1)"
HANGS = "import time; time.sleep(600)"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(kernel_cache, "kernel_folder", lambda: tmp_path)
    return tmp_path


def preparing(program: str, folder: Path, longest_s: float = 60) -> Preparation:
    return Preparation(None, (sys.executable, "-S", "-c", program, str(folder)), longest_s)


def test_what_is_wanted_is_compiled_once(qtbot: QtBot, folder: Path) -> None:
    work = preparing(KEEPS, folder)
    told: list[tuple[int, int]] = []
    work.progressed.connect(lambda done, of: told.append((done, of)))
    assert not work.is_prepared(IMAGES)
    work.want([IMAGES, QUESTIONS])
    work.want([IMAGES, QUESTIONS])
    qtbot.waitUntil(lambda: told[-1] == (2, 2) and not work._running)
    assert IMAGES.is_prepared
    assert QUESTIONS.is_prepared
    assert told[0] == (0, 2)
    # Another window finds them.
    again = preparing(FAILS, folder)
    again.want([IMAGES])
    assert again.is_prepared(IMAGES)
    assert not again._running


@pytest.mark.parametrize(("program", "longest_s"), [(FAILS, 60), (HANGS, 0.1)])
def test_what_fails_or_hangs_is_left_to_the_engines(
    qtbot: QtBot, folder: Path, program: str, longest_s: float
) -> None:
    work = preparing(program, folder, longest_s)
    with qtbot.waitSignal(work.prepared):
        work.want([IMAGES])
    assert work.is_prepared(IMAGES)
    assert not IMAGES.is_prepared


def test_a_program_that_cannot_start_is_left_to_the_engines(qtbot: QtBot, folder: Path) -> None:
    work = Preparation(None, (str(folder / "nowhere"),))
    work.want([IMAGES])
    qtbot.waitUntil(lambda: work.is_prepared(IMAGES))


def test_where_nothing_can_be_kept_nothing_is_started(
    monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.setattr(preparation, "keeps_kernels", lambda: False)
    work = preparing(HANGS, folder)
    work.want([IMAGES])
    assert work.is_prepared(IMAGES)
    assert not work._running


def test_the_end_of_the_window_is_theirs(folder: Path) -> None:
    work = preparing(HANGS, folder)
    work.want([IMAGES, QUESTIONS])
    processes = list(work._running.values())
    assert len(processes) == 2
    work.stop()
    assert all(process.state() is process.ProcessState.NotRunning for process in processes)
    assert not IMAGES.is_prepared
