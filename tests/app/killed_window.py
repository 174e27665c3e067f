"""A window that edits at random until it is killed: ``killed_window.py FOLDER SEED``.

The folders of this file, of all tests and of tfscope must be on PYTHONPATH.

It prints one line of JSON after each edit: when it was made, and what is to be kept.
"""

import json
import random
import sys
import time
from dataclasses import astuple
from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
from window_fakes import FakeBuilders

from app.state.preferences import Preferences
from app.window.main_window import MainWindow
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.scene.view import View


def main(folder, seed):
    """Open a window and edit it 20 times a second."""
    application = QApplication([])
    window = MainWindow(FakeBuilders().make(), preferences=Preferences(folder))
    window.workspace.opening.open(Path("ramp.nrrd"))
    window.show()
    rng = random.Random(seed)
    state = window.state

    def edit():
        opened = window.workspace.opened
        if opened is None:
            return
        span = state.scalar_range
        mode = GaussianMode(rng.uniform(*span), (span[1] - span[0]) / 9, rng.random())
        tf = state.transfer_function
        state.tf_input.set(type(tf)(OpacityTF(span, (mode,)), tf.color), "an edit")
        state.set_view(View(rng.uniform(0, 360), rng.uniform(-80, 80)))
        window.resize(1300 + rng.randrange(200), 800)
        kept = {
            "made": time.time(), "fingerprint": opened.fingerprint, "amplitude": mode.amplitude,
            "view": astuple(state.view),
        }  # fmt: skip
        print(json.dumps(kept), flush=True)

    timer = QTimer(interval=50)
    timer.timeout.connect(edit)
    timer.start()
    application.exec()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
