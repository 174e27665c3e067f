"""A window under fire keeps its pictures, its threads and its temper."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

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
