from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from app.cli import run as run_command
from app.state import model_folders, training_run
from app.state.model_folders import new_model_folder
from app.state.training_clock import MEASURING_S, MINUTES, PREPARING_S, TrainingClock, usual_minutes
from app.state.training_run import TrainingRun
from model.errors import TrainingError
from model.generator.catalog import shipped_models
from model.volume_files.shipped import DEFAULT_VOLUME

PATIENCE_MS = 60_000

Script = Callable[[str], TrainingRun]

HEAD = """
import json, os, signal, sys, time
from pathlib import Path
out = Path(sys.argv[sys.argv.index("--out") + 1])
def say(kind, **data):
    # Not by print: a signal's handler may interrupt one, and must not begin another.
    os.write(1, (json.dumps({"kind": kind, **data}) + chr(10)).encode())
def wait_for_ever():
    while True:
        time.sleep(.01)
"""


@pytest.fixture
def script(qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Script]:
    """Make a run of a program of the test's, instead of tfscope."""
    made = []
    real = new_model_folder
    monkeypatch.setattr(training_run, "new_model_folder", lambda name: real(name, tmp_path / "own"))

    def make(text: str) -> TrainingRun:
        path = tmp_path / "program.py"
        path.write_text(HEAD + text)
        made.append(TrainingRun(command=(sys.executable, "-I", "-S", str(path))))
        return made[-1]

    yield make
    for run in made:
        run.join()


def test_a_run_tells_how_far_it_is_and_ends_with_a_model(
    qtbot: QtBot, script: Script, tmp_path: Path
) -> None:
    run = script(
        "say('execution')\nprint('for people')\n"
        "for n in (0, 1, 2): say('progress', spent=n / 2)\n"
        "say('measuring')\nsay('end', how='finished', verdict='It pays.')"
    )
    told: list[tuple[float, str]] = []
    run.progressed.connect(lambda fraction, words: told.append((fraction, words)))
    assert not run.is_running
    with qtbot.waitSignal(run.finished, timeout=PATIENCE_MS) as end:
        run.start(tmp_path / "engine_8x8x8_uint8.raw")
        assert run.is_running
    assert end.args == [tmp_path / "own" / "engine-1"]
    assert (run.verdict, run.volume_name, run.is_running) == ("It pays.", "engine", False)
    assert told[0] == (pytest.approx(0, abs=1e-3), "preparing, about 31 min left")


def test_what_is_asked_for_is_what_the_command_line_understands(
    qtbot: QtBot, script: Script, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seen = tmp_path / "arguments.json"
    run = script(f"Path({str(seen)!r}).write_text(json.dumps(sys.argv[1:]))")
    volume = tmp_path / "a_8x8x8_uint8.raw"
    volume.write_bytes(bytes(512))
    options: dict[str, Any] = {"minutes": 0.5, "preset": "draft", "lighting": "direct"}
    with qtbot.waitSignal(run.failed, timeout=PATIENCE_MS):
        run.start(volume, tmp_path / "out", raw_layout="8x8x8_uint8", up="-z", **options)
    arguments = json.loads(seen.read_text())
    arguments.remove("--json-lines")
    job = tmp_path / "job.json"
    assert run_command([*arguments, "--save-job", str(job)]) == 0
    written = json.loads(job.read_text())
    assert {name: written[name] for name in options} == options
    assert (written["volume"]["path"], written["volume"]["raw"]) == (str(volume), "8x8x8_uint8")
    assert written["movable_light"]
    assert (written["up"], written["out"]) == ("-z", str(tmp_path / "out"))
    with qtbot.waitSignal(run.failed, timeout=PATIENCE_MS):
        run.start(volume, scalar_range=(-1000.0, 300.5))
    unlit = json.loads(seen.read_text())
    assert "--range=-1000.0,300.5" in unlit
    assert "--movable-light" not in unlit


@pytest.mark.parametrize(
    ("program", "said"),
    [
        (
            "say('end', how='failed', error='a.nrrd: the file is empty.'); sys.exit(2)",
            "a.nrrd: the",
        ),
        ("sys.exit('tfscope: No such option. Try: --help')", "'a' failed: No such option."),
        ("raise ValueError('a defect')", "'a' failed: ValueError: a defect"),
        ("os.kill(os.getpid(), signal.SIGKILL)", "ended by the system"),
        ("sys.exit(3)", "code 3"),
    ],
)
@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_what_fails_is_said_and_leaves_no_folder(
    qtbot: QtBot, script: Script, tmp_path: Path, program: str, said: str
) -> None:
    run = script("(out / 'training.lock').touch()\n" + program)
    with qtbot.waitSignal(run.failed, timeout=PATIENCE_MS) as end:
        run.start(tmp_path / "a.nrrd")
    assert said in end.args[0]
    assert "Try:" not in end.args[0]
    assert list((tmp_path / "own").iterdir()) == []


def test_a_program_that_cannot_be_started_is_said(qtbot: QtBot, tmp_path: Path) -> None:
    run = TrainingRun(command=(str(tmp_path / "gone"),))
    with qtbot.waitSignal(run.failed, timeout=PATIENCE_MS) as end:
        run.start(tmp_path / "a.nrrd", tmp_path / "out")
    assert str(tmp_path / "gone") in end.args[0]
    assert not run.is_running


STOPPED = """
def stop(*_):
    (out / 'training.json').write_text('{}')
    say('end', how='stopped', saved=True)
    sys.exit(130)
signal.signal(signal.SIGINT, stop)
if '--resume' in sys.argv:
    say('end', how='finished')
else:
    say('progress', spent=.5)
    wait_for_ever()
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_cancelled_run_is_saved_and_goes_on(qtbot: QtBot, script: Script, tmp_path: Path) -> None:
    run = script(STOPPED)
    told: list[str] = []
    run.progressed.connect(lambda _fraction, words: told.append(words))
    run.failed.connect(pytest.fail)
    run.start(tmp_path / "a.nrrd")
    qtbot.waitUntil(lambda: told[-1].startswith("training"), timeout=PATIENCE_MS)
    with qtbot.waitSignal(run.cancelled, timeout=PATIENCE_MS):
        run.cancel()
    assert (tmp_path / "own" / "a-1" / "training.json").exists()
    with qtbot.waitSignal(run.finished, timeout=PATIENCE_MS) as end:
        run.start(tmp_path / "a.nrrd")
    assert end.args == [tmp_path / "own" / "a-1"]
    with qtbot.waitSignal(run.finished, timeout=PATIENCE_MS) as end:
        # Another one is new; to end, it is cancelled while it is measured.
        (tmp_path / "program.py").write_text(HEAD + "say('measuring')\nwait_for_ever()")
        run.start(tmp_path / "b.nrrd")
        qtbot.waitUntil(lambda: told[-1].startswith("measuring"), timeout=PATIENCE_MS)
        run.cancel()
    assert end.args == [tmp_path / "own" / "b-1"]


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_what_does_not_listen_is_killed(
    qtbot: QtBot, script: Script, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training_run, "PATIENCE_MS", 50)
    run = script(
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\nsay('progress', spent=.5)\nwait_for_ever()"
    )
    for end in (run.cancel, run.join):
        told: list[str] = []
        run.progressed.connect(lambda _fraction, words, told=told: told.append(words))
        run.start(tmp_path / "a.nrrd")
        qtbot.waitUntil(lambda told=told: told[-1].startswith("training"), timeout=PATIENCE_MS)
        with qtbot.waitSignal(run.cancelled, timeout=PATIENCE_MS):
            end()
        assert not run.is_running
    assert list((tmp_path / "own").iterdir()) == []


def test_no_model_is_written_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ["head", "head", "../up\\ a:b*", "", "é 3"]
    made = [new_model_folder(name, tmp_path / "models") for name in names]
    assert [f.name for f in made] == ["head-1", "head-2", "up_a_b-1", "volume-1", "é_3-1"]
    assert all(folder.parent == tmp_path / "models" and folder.is_dir() for folder in made)
    (tmp_path / "file").write_text("")
    with pytest.raises(TrainingError, match="file"):
        new_model_folder("head", tmp_path / "file" / "models")


def test_a_folder_that_is_used_stays(tmp_path: Path) -> None:
    folder = new_model_folder("head", tmp_path)
    (folder / "training.json").write_text("")
    model_folders.remove_if_unused(folder)
    assert folder.exists()


def test_the_clock_goes_on_and_follows_what_the_run_says(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    clock, whole = TrainingClock(1.0), PREPARING_S + 60 + MEASURING_S
    assert usual_minutes(1.0) == round(whole / 60)
    now = PREPARING_S / 2
    assert clock.fraction == pytest.approx(now / whole)
    clock.note_spent(0.25)
    assert clock.fraction == pytest.approx((PREPARING_S + 15) / whole)
    now += 1000
    assert clock.fraction == pytest.approx((PREPARING_S + 15) / whole)
    assert clock.words == "training, about 1 min left"
    clock.enter("measuring")
    now += MEASURING_S / 2
    assert clock.fraction == pytest.approx(1 - MEASURING_S / 2 / whole)
    assert clock.words == "measuring, about 10 s left"
    now += MEASURING_S
    assert clock.words == f"measuring for {round(1.5 * MEASURING_S)} s, longer than usual"
    assert clock.fraction == 1


@pytest.mark.slow
def test_a_real_training_gives_a_model_that_can_be_opened(qtbot: QtBot, tmp_path: Path) -> None:
    from app.state.library import Library
    from app.state.preferences import Preferences
    from model.generator.generator import Generator

    assert MINUTES > 0.02
    run = TrainingRun()
    with qtbot.waitSignal(run.finished, timeout=300_000) as end:
        run.start(DEFAULT_VOLUME, tmp_path / "model", minutes=0.02, preset="draft")
    (folder,) = end.args
    check = Library(Preferences()).check_model(folder)
    shipped = [Library(Preferences()).check_model(f).scene for f in shipped_models()]
    assert check.is_fine and run.verdict and check.worth.startswith("RMSE of 128 hold-out images")
    assert check.scene is not None
    fingerprints = {scene.volume_fingerprint for scene in shipped if scene is not None}
    assert check.scene.volume_fingerprint in fingerprints
    assert Generator.load(folder).scene == check.scene
