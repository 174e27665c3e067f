"""Five screenshots of a window on fake engines, against stored ones, coarsely: its layout.

What is compared is the mean brightness of blocks, which neither another font nor another scale of
the screen changes much. ``pytest tests/pictures tests/app/window/test_window_pictures.py
--regenerate-pictures`` stores them anew.
"""

from functools import partial
from itertools import combinations
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication
from toy_codec import toy_space
from window_fakes import PATIENCE_S

from app.theme import apply_theme
from app.window.figure import FigureChoice
from app.window.figure_dialog import FigureDialog
from model.scene.region import Outline

STORED = Path(__file__).parents[2] / "pictures" / "stored" / "window"
FAILED = Path(__file__).parents[3] / "build" / "pictures"

BLOCKS = 48, 30  # blocks along a picture's width and height

MOST_RMSE = 0.025  # largest root mean square difference of blocks, where 1 is white

NAMES = ("start", "browser", "value", "region", "dialog")


def blocks(widget):
    """Mean brightness of a widget's blocks, shape (30, 48)."""
    gray = widget.grab().toImage().convertToFormat(QImage.Format.Format_Grayscale8)
    lines = np.frombuffer(gray.constBits(), np.uint8).reshape(gray.height(), -1)
    pixels = lines[:, : gray.width()].astype(float)
    rows = np.linspace(0, gray.height(), BLOCKS[1] + 1).astype(int)
    columns = np.linspace(0, gray.width(), BLOCKS[0] + 1).astype(int)
    sums = np.add.reduceat(np.add.reduceat(pixels, rows[:-1], 0), columns[:-1], 1)
    return np.rint(sums / np.outer(np.diff(rows), np.diff(columns))).astype(np.uint8)


def difference(a, b):
    return float(np.sqrt(np.mean((a.astype(float) - b) ** 2)) / 255)


def shown(name, qtbot, window):
    """Bring the window to where a picture is of, and return what is pictured."""
    window.resize(1440, 900)
    wait = partial(qtbot.waitUntil, timeout=1000 * PATIENCE_S)
    if name == "region":
        window.sensitivity_state.hover(None)
        window.sensitivity_state.add_region(Outline.rectangle(0.3, 0.3, 0.7, 0.6))
        window.sensitivity_state.finish_region()
        window.sensitivity.findings.set_open(True)
    elif name == "value":
        window.latent_state.choose(shown=False)
        window.sensitivity_state.hover(150.0, effect=False)
        wait(lambda: window.generator.canvas.cover is not None)
    elif name == "browser":
        window.latent_state.choose(shown=True)
        work = window.workspace.latent
        wait(lambda: work.grid is not None)
        wait(lambda: work.session.overview is not None)
    elif name == "dialog":
        dialog = FigureDialog({"reference": (960, 720)}, FigureChoice(960, 720))
        qtbot.addWidget(dialog)
        dialog.show()
        return dialog
    answers = window.workspace.sensitivity
    wait(lambda: window.workspace.is_settled)
    wait(lambda: answers.is_fresh(answers.region))
    wait(lambda: answers.visibility is not None and answers.visibility.is_of(window.state.inputs))
    QApplication.processEvents()
    return window


@pytest.fixture
def window(qapp, make_window, builders, tmp_path):
    space = toy_space(tmp_path, (100.0, 200.0), (100.0, 200.0))
    codes = space.open_map().codes
    space.keep_map(codes, 0.9 * codes)
    builders.map_folder = tmp_path
    apply_theme(qapp, "dark")
    return make_window()


def test_the_window_looks_as_stored(qtbot, window, request):
    different = {}
    for name in NAMES:
        drawn, path = blocks(shown(name, qtbot, window)), STORED / f"{name}.png"
        if request.config.getoption("--regenerate-pictures", default=False):
            iio.imwrite(path, drawn)
        found = difference(drawn, np.asarray(iio.imread(path)))
        if found > MOST_RMSE:
            FAILED.mkdir(parents=True, exist_ok=True)
            iio.imwrite(FAILED / path.name, drawn)
            different[name] = found
    assert not different, f"compare {STORED} with {FAILED}"


def test_stored_pictures_differ_by_more_than_is_tolerated():
    pictures = {name: np.asarray(iio.imread(STORED / f"{name}.png")) for name in NAMES}
    apart = {(a, b): difference(pictures[a], pictures[b]) for a, b in combinations(NAMES, 2)}
    assert min(apart.values()) > MOST_RMSE, apart
