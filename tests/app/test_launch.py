import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QObject, QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication
from ramp import make_tf
from window_fakes import red_of

from app import launch
from app.launch import run_window
from app.state.window_start import WindowStart
from app.window.main_window import MainWindow
from model.errors import CheckpointError
from model.scene.transfer_function import GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.volume_files import read_volume
from model.volume_files.shipped import RESOURCES, SAMPLES

START = WindowStart(Path("ramp"), Path("model"))


def test_a_screenshot_shows_both_images(builders, tmp_path):
    path = tmp_path / "window.png"
    code = run_window(START, "auto", path, builders.make())
    image = QImage(str(path))
    assert code == 0
    assert (image.width(), image.height()) == (1440, 900)
    # The fake engines paint plain red of a level that grows with each request.
    last = [engine.requests[-1] for engine in (builders.generators[0], builders.references[-1])]
    assert last[0].inputs == last[1].inputs
    for x, request in zip((320, 960), last, strict=True):
        assert not request.quality.live
        assert request.is_fixed  # all pixels, however busy the computer is
        assert image.pixelColor(x, 300).getRgb() == (red_of(request), 0, 0, 255)


def test_the_window_starts_as_it_is_told(builders, tmp_path):
    tf = TransferFunction(
        OpacityTF((100.0, 200.0), (GaussianMode(140.0, 5.0, 0.3),)), make_tf().color
    )
    tf.save(tmp_path / "tf.json")
    view = View(10.0, -20.0, 5.0, 0.6)
    start = WindowStart(
        Path("ramp"), Path("model"), tf=tmp_path / "tf.json", view=view, size=(1400, 900)
    )
    path = tmp_path / "window.png"
    assert run_window(start, "auto", path, builders.make()) == 0
    image = QImage(str(path))
    assert (image.width(), image.height()) == (1400, 900)
    for engine in (builders.generators[0], builders.references[0]):
        assert engine.requests[-1].inputs.view == view
        assert engine.requests[-1].inputs.transfer_function == tf


@pytest.mark.parametrize("file", [None, *SAMPLES])
def test_each_shipped_volume_opens_with_its_tf_view_and_light(builders, tmp_path, file):
    sample, path = SAMPLES.get(file), RESOURCES / "volumes" / str(file)
    if sample is not None:
        builders.volumes["sample"] = read_volume(path)
    start = WindowStart(Path("ramp" if sample is None else "sample"))
    for asked, lighting in ((None, sample.lighting if sample else "soft"), ("direct", "direct")):
        start = replace(start, lighting=asked)
        assert run_window(start, "auto", tmp_path / "a.png", builders.make()) == 0
        assert builders.settings[-1].lighting == lighting
    if sample is not None:
        inputs = builders.references[-1].requests[-1].inputs
        assert inputs.transfer_function == TransferFunction.load(path.with_suffix(".tf.json"))
        assert inputs.light == sample.light
        assert (inputs.view.azimuth, inputs.view.elevation) == pytest.approx(sample.angles)


@pytest.mark.parametrize("broken", ["volume", "model"])
def test_an_error_is_in_the_picture_and_printed(builders, tmp_path, capsys, broken):
    path = tmp_path / "window.png"
    if broken == "model":
        builders.generator_error = CheckpointError("model: the weights are truncated.")
    volume = Path("gone" if broken == "volume" else "ramp")
    assert run_window(WindowStart(volume, Path("model")), "auto", path, builders.make()) == 2
    assert path.exists()
    printed = capsys.readouterr().err.splitlines()
    expected = {
        "volume": "gone: the file is missing; choose another.",
        "model": "model: the weights are truncated.",
    }
    assert printed == [expected[broken]]


@pytest.mark.skipif(os.name != "posix", reason="only Linux can be without a display")
@pytest.mark.parametrize(
    "gone", [{}, {"DISPLAY": ":977.0"}, {"DISPLAY": "?"}, {"WAYLAND_DISPLAY": "gone-0"}]
)
def test_without_a_display_one_sentence_names_the_way_out(builders, monkeypatch, capsys, gone):
    monkeypatch.setattr("sys.platform", "linux")
    for variable in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(variable, raising=False)
    for variable, value in gone.items():
        monkeypatch.setenv(variable, value)
    assert run_window(WindowStart(Path("ramp")), "auto", None, builders.make()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "--screenshot" in line


def test_control_c_closes_the_window(builders, tmp_path, monkeypatch):
    monkeypatch.setattr(launch, "user_folder", lambda: tmp_path)
    before = signal.getsignal(signal.SIGINT)
    opened = []

    def interrupt():
        windows = [w for w in QApplication.topLevelWidgets() if isinstance(w, MainWindow)]
        opened.append(windows[0].isVisible())
        os.kill(os.getpid(), signal.SIGINT)

    QTimer.singleShot(0, interrupt)
    assert run_window(WindowStart(Path("ramp")), "auto", None, builders.make()) == 0
    assert opened == [True]
    assert signal.getsignal(signal.SIGINT) is before


def test_an_image_that_never_comes_does_not_hang_the_screenshot(
    builders, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(launch, "SCREENSHOT_PATIENCE_S", 0)
    path = tmp_path / "window.png"
    builders.loading = loading = threading.Event()

    def load_after_the_screenshot():
        while not path.exists():
            threading.Event().wait(0.005)
        loading.set()

    helper = threading.Thread(target=load_after_the_screenshot)
    helper.start()
    assert run_window(START, "auto", path, builders.make()) == 2
    helper.join()
    assert "before both images" in capsys.readouterr().err


def test_the_window_is_there_before_slow_libraries_are_loaded():
    slow = ("cmap", "numba", "scipy", "skimage", "torch", "vtkmodules", "zarr")
    code = (
        "import sys, app.window.main_window\n"
        "from app.state.library import Library\n"
        "from app.state.preferences import Preferences\n"
        "from model.generator.catalog import shipped_models\n"
        "library = Library(Preferences())\n"
        "assert all(map(library.check_model, shipped_models()))\n"
        f"print([m for m in {slow} if m in sys.modules])\n"
        # PySide would read the sources of all that is imported from then on.
        "import linecache\n"
        "from app.quick_imports import leave_sources_unread\n"
        "leave_sources_unread()\n"
        "linecache.clearcache()\n"
        "import scipy.ndimage\n"
        "print(sum('scipy' in name for name in linecache.cache))"
    )
    found = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    assert found.stdout.split() == ["[]", "0"]


def test_calls_keep_the_references_to_none():
    """PySide6 6.12.0 under Python 3.11 lost one at every call, and the window crashed."""
    an_object = QObject()
    before = sys.getrefcount(None)
    for _ in range(2000):
        an_object.setObjectName("name")
    assert sys.getrefcount(None) > before - 1000
