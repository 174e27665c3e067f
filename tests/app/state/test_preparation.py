import sys
import threading

import numpy as np
import pytest
from PySide6.QtCore import QProcess
from rested_window import act_until
from window_fakes import PATIENCE_S, FakeEngine, make_request

from app.engines import worker
from app.engines.client import Channel, EngineClient
from app.engines.requests import BatchRequest
from app.state import preparation, slow_answers
from app.state.preparation import Preparation
from app.state.slow_answers import SlowAnswers
from model import kernel_cache
from model.kernel_cache import KernelGroup

IMAGES = KernelGroup("uint8", "direct", "images")
QUESTIONS = KernelGroup("uint8", "direct", "questions")

STARTED = "import os, pathlib, sys; folder = pathlib.Path(sys.argv[1])\n"
KEEPS = (
    STARTED
    + "(folder / f'process {os.getpid()}').touch()\n"
    + "for line in sys.stdin:\n"
    + "    (folder / line.strip()).touch()\n"
    + "    print(line.strip(), flush=True)\n"
)
FAILS = "import sys; sys.exit(1)"
HANGS = "import time; time.sleep(600)"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_cache, "kernel_folder", lambda: tmp_path)
    monkeypatch.setattr(KernelGroup, "_stamp", property(lambda group: tmp_path / group.name))
    return tmp_path


def preparing(program, folder, longest_s=60):
    work = Preparation(None, (sys.executable, "-S", "-c", program, str(folder)), longest_s)
    work.begin()
    return work


def processes_of(work):
    return work.findChildren(QProcess)


def test_what_is_wanted_is_compiled_once(qtbot, folder):
    work = preparing(KEEPS, folder)
    told = []
    work.progressed.connect(lambda done, of, _text: told.append((done, of)))
    assert not work.is_prepared(IMAGES)
    work.want([IMAGES, QUESTIONS])
    work.want([IMAGES, QUESTIONS])
    qtbot.waitUntil(lambda: told[-1] == (2, 2) and not processes_of(work))
    assert IMAGES.is_prepared
    assert QUESTIONS.is_prepared
    assert told[0] == (0, 2)
    # Another window finds them.
    again = preparing(FAILS, folder)
    again.want([IMAGES])
    assert again.is_prepared(IMAGES)
    assert not processes_of(again)


def test_the_time_left_never_rises(monkeypatch, folder):
    work, now, said = Preparation(), [0.0], []
    monkeypatch.setattr(preparation, "monotonic", lambda: now[0])
    work.progressed.connect(lambda *_: said.append(int(work.text.split()[2])))
    work.want([IMAGES, QUESTIONS])
    for now[0] in (5.0, 300.0, 3000.0):
        work._say_progress()
    assert said[0] > said[1] and said == sorted(said, reverse=True)
    work.stop()


def test_few_processes_compile_all_that_is_wanted(qtbot, folder):
    work = preparing(KEEPS, folder)
    lights = ("none", "direct", "soft", "path")
    groups = [KernelGroup(kind, light, "images") for light in lights for kind in ("int8", "uint8")]
    work.want(groups)
    qtbot.waitUntil(lambda: all(group.is_prepared for group in groups))
    assert 1 <= len(list(folder.glob("process *"))) <= preparation.PROCESSES
    # Those that have nothing left to do give their memory back.
    qtbot.waitUntil(lambda: not processes_of(work))


def test_nothing_is_compiled_before_the_first_picture_unless_that_takes_long(
    qtbot, folder, monkeypatch
):
    monkeypatch.setattr(preparation, "PATIENCE_MS", 200)
    command = sys.executable, "-S", "-c", KEEPS, str(folder)
    at_once, patient = Preparation(None, command), Preparation(None, command)
    for work in (at_once, patient):
        work.want([IMAGES])
        assert not processes_of(work)
    at_once.begin()
    assert processes_of(at_once)
    qtbot.waitUntil(lambda: bool(processes_of(patient)) or patient.is_prepared(IMAGES))
    qtbot.waitUntil(lambda: IMAGES.is_prepared)
    for work in (at_once, patient):
        work.stop()


@pytest.mark.parametrize(("program", "longest_s"), [(FAILS, 60), (HANGS, 0.1), ("", 60)])
def test_what_fails_or_hangs_is_left_to_the_engines(qtbot, folder, program, longest_s):
    work = preparing(program, folder, longest_s)
    if not program:
        # One that cannot start.
        work = Preparation(None, (str(folder / "nowhere"),))
        work.begin()
    act_until(qtbot, work.prepared, work.want, [IMAGES])
    assert work.is_prepared(IMAGES)
    assert not IMAGES.is_prepared


def test_where_nothing_can_be_kept_nothing_is_started(monkeypatch, folder):
    monkeypatch.setattr(preparation, "keeps_kernels", lambda: False)
    work = preparing(HANGS, folder)
    work.want([IMAGES])
    assert work.is_prepared(IMAGES)
    assert not processes_of(work)


def test_the_end_of_the_window_is_theirs(folder):
    work = preparing(HANGS, folder)
    work.want([IMAGES, QUESTIONS])
    processes = processes_of(work)
    assert len(processes) == 2
    work.stop()
    assert all(process.state() is process.ProcessState.NotRunning for process in processes)
    assert not IMAGES.is_prepared


class Slow(FakeEngine):
    """Draws half of several images, and the other when it may."""

    may_end = threading.Semaphore(0)

    def images(self, request, watch):
        watch.note(0.5)
        assert self.may_end.acquire(timeout=PATIENCE_S)
        watch.note(0.75)
        return np.zeros((1, 8, 8, 4), np.float32)


def test_what_takes_long_is_told_until_it_is_there_or_called_off(qtbot, monkeypatch):
    monkeypatch.setattr(worker, "PROGRESS_S", 0.0)
    monkeypatch.setattr(slow_answers, "PATIENCE_MS", 40)
    client, told, image = EngineClient("test"), [], make_request(1)
    channels = [Channel(client, name, client) for name in ("one", "two")]
    work = SlowAnswers(channels, client)
    work.changed.connect(told.append)
    act_until(qtbot, client.engineReady, client.start, Slow, "Loading …")
    channels[0].ask(BatchRequest(image.inputs, image.quality))
    qtbot.waitUntil(lambda: told == [0.0])
    Slow.may_end.release()
    qtbot.waitUntil(lambda: told == [0.0, 0.75, None])
    told.clear()
    for channel in channels:
        channel.ask(BatchRequest(image.inputs, image.quality))
    qtbot.waitUntil(lambda: told == [0.0])
    channels[0].cancel()
    # The other is still awaited.
    assert told == [0.0]
    client.stop()
    assert told == [0.0, None]
    Slow.may_end.release(10)
    client.join()
