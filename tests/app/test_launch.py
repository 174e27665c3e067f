import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from dataclasses import astuple, replace
from pathlib import Path

import pytest
from PySide6.QtCore import QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication
from ramp import make_tf
from window_fakes import red_of

from app import launch
from app.engines import compilation
from app.engines.engines import REAL_BUILDERS
from app.engines.requests import ReferenceSettings
from app.launch import run_window
from app.state.preferences import settings_file, volume_file
from app.state.window_start import WindowStart
from app.window.main_window import MainWindow
from model.errors import CheckpointError
from model.kernel_cache import KernelGroup
from model.scene.view import View
from model.volume_files import read_volume
from model.volume_files.shipped import SAMPLES

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
    tf, view = make_tf(140.0), View(10.0, -20.0, 5.0, 0.6)
    tf.save(tmp_path / "tf.json")
    start = replace(START, tf=tmp_path / "tf.json", view=view, size=(1400, 900))
    path = tmp_path / "window.png"
    assert run_window(start, "auto", path, builders.make()) == 0
    assert QImage(str(path)).size().toTuple() == (1400, 900)
    for engine in (builders.generators[0], builders.references[0]):
        assert engine.requests[-1].inputs.view == view
        assert engine.requests[-1].inputs.transfer_function == tf


@pytest.mark.parametrize("sample", [None, *SAMPLES])
def test_each_shipped_volume_opens_with_its_tf_view_and_light(builders, tmp_path, sample):
    if sample is not None:
        builders.volumes["sample"] = read_volume(sample.path)
    start = WindowStart(Path("ramp" if sample is None else "sample"))
    own = sample.lighting if sample else "soft"
    # A given model is seen in its own light.
    looks = [({"model": START.model}, "none soft"), ({"lighting": "direct"}, "direct"), ({}, own)]
    for asked, lightings in looks if sample in (None, SAMPLES[0]) else looks[-1:]:
        start = replace(WindowStart(start.volume), **asked)
        assert run_window(start, "auto", tmp_path / "a.png", builders.make()) == 0
        assert builders.settings[-1].lighting in lightings.split()
    if sample is not None:
        inputs = builders.references[-1].requests[-1].inputs
        assert inputs.transfer_function == sample.tf
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
    (line,) = capsys.readouterr().err.splitlines()
    assert ("gone: the file is missing" if broken == "volume" else "truncated") in line


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
    before, opened = signal.getsignal(signal.SIGINT), []

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


FOLDERS = Path(__file__).parents[:3]  # of this file, of all tests and of tfscope
CHEST = "resources/volumes/lidc_chest_256x256x133_int16.nrrd"


@pytest.mark.slow
@pytest.mark.parametrize("lighting", ["direct", "path"])
def test_what_is_prepared_is_not_compiled_again(tmp_path, lighting):
    settings = ReferenceSettings(lighting, renderer="raycast")
    names = [group.name for group in REAL_BUILDERS.kernels(compilation._ball("int16"), settings)]
    _run(tmp_path, "-m", "app.prepare_kernels", *names)
    compiled = _kernels(tmp_path)
    assert compiled
    # The window, with its answers, and a picture to save.
    picture = str(tmp_path / "picture.png")
    looks = f"--volume {CHEST} --lighting {lighting} --renderer raycast".split()
    _run(tmp_path, "main.py", "--screenshot", picture, "--size", "600x400", *looks)
    _run(tmp_path, "main.py", "render", "--size", "32", "--out", picture, *looks)
    assert _kernels(tmp_path) == compiled


@pytest.mark.parametrize(
    ("voxels", "kind"), [("uint8", "uint8"), ("float32", "float32"), ("float64", "float32")]
)
def test_kernels_are_those_of_the_voxels_that_are_drawn(voxels, kind):
    volume = compilation._ball(voxels)
    found = REAL_BUILDERS.kernels(volume, ReferenceSettings("soft"))
    assert found == (KernelGroup(kind, "soft", "images"), KernelGroup(kind, "soft", "questions"))


def _run(cache, *arguments):
    environment = os.environ | {"XDG_CACHE_HOME": str(cache)}
    command = [sys.executable, *arguments]
    subprocess.run(command, cwd=FOLDERS[2], env=environment, capture_output=True, check=True)


def _kernels(cache):
    return {file.name for file in cache.rglob("*.nbc")}


SCRIPT = Path(__file__).with_name("killed_window.py")

KILLS = int(os.environ.get("TFSCOPE_KILLS", "4"))  # number of kills; a job gives more

LOST_S = 1.0  # edits older than this are kept


def killed(folder, seed):
    """Have a window edit for a random time, kill it, and return its edits and when it ended."""
    window = subprocess.Popen(
        [sys.executable, str(SCRIPT), str(folder), str(seed)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, FOLDERS))},
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


@pytest.mark.slow
def test_kills_lose_less_than_a_second(tmp_path):
    # All in one folder: each start reads what the one before has left.
    for seed in range(KILLS):
        edits, end = killed(tmp_path, seed)
        settings = settings_file(tmp_path).values
        memory = volume_file(tmp_path, edits[0]["fingerprint"]).values
        assert not list(tmp_path.rglob("*.damaged"))
        settled = [edit for edit in edits if edit["made"] < end - LOST_S]
        if not settled:
            continue
        # One of the last second's edits, or the last before it.
        newest = [edit for edit in edits if edit["made"] >= settled[-1]["made"]]
        assert memory.tf is not None and memory.view is not None
        assert memory.tf.opacity.modes[0].amplitude in [edit["amplitude"] for edit in newest]
        assert list(astuple(memory.view)) in [edit["view"] for edit in newest]
        assert settings.window_geometry


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
