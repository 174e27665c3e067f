import json
import os
import random
import subprocess
import sys
import time
from dataclasses import astuple
from pathlib import Path

import pytest

from app.state.preferences import settings_file, volume_file

SCRIPT = Path(__file__).with_name("killed_window.py")

KILLS = int(os.environ.get("TFSCOPE_KILLS", "4"))  # number of kills; a job gives more

LOST_S = 1.0  # edits older than this are kept


def killed(folder, seed):
    """Have a window edit for a random time, kill it, and return its edits and when it ended."""
    window = subprocess.Popen(
        [sys.executable, str(SCRIPT), str(folder), str(seed)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, SCRIPT.parents[:3]))},
        stdout=subprocess.PIPE,
        text=True,
    )
    lines = [window.stdout.readline()]
    assert lines[0], "the window has ended by itself"
    time.sleep(random.Random(seed).uniform(0.0, 2.5))
    end = time.time()
    window.kill()
    lines += window.stdout.readlines()
    window.stdout.close()
    window.wait()
    whole = [line for line in lines if line.endswith("\n")]
    return [json.loads(line) for line in whole], end


def kept_after(folder, edits, end):
    fingerprint = edits[0]["fingerprint"]
    settled = [edit for edit in edits if edit["made"] < end - LOST_S]
    settings, memory = settings_file(folder).values, volume_file(folder, fingerprint).values
    assert not list(folder.rglob("*.damaged"))
    if not settled:
        return
    # One of the last second's edits, or the last before it.
    newest = [edit for edit in edits if edit["made"] >= settled[-1]["made"]]
    assert memory.tf is not None and memory.view is not None
    assert memory.tf.opacity.modes[0].amplitude in [edit["amplitude"] for edit in newest]
    assert list(astuple(memory.view)) in [edit["view"] for edit in newest]
    assert settings.window_geometry


@pytest.mark.slow
def test_kills_lose_less_than_a_second(tmp_path):
    # All in one folder: each start reads what the one before has left.
    for seed in range(KILLS):
        edits, end = killed(tmp_path, seed)
        kept_after(tmp_path, edits, end)


FOLDERS = Path(__file__).parents[:3]


@pytest.mark.slow
def test_random_events_and_unreliable_engines():
    # In a process of its own: dialogs are answered there by others than the user.
    options = ["-X", "faulthandler", "-m", "tests.app.monkey", "--events", "400", "--seed", "5"]
    done = subprocess.run(
        [sys.executable, *options],
        cwd=FOLDERS[2],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, FOLDERS))},
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "threads left: []; errors: 0" in done.stdout
