"""Files that the window opens from the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.cli import run
from app.state.window_start import WindowStart
from model.generator.catalog import shipped_models
from model.scene.crop import CropBox
from model.scene.light import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction
from model.scene.view import View
from model.volume_files.shipped import SCAN, shipped_volumes

MODEL, VOLUME = shipped_models()[0], shipped_volumes()[0]


@pytest.fixture
def opened(monkeypatch, tmp_path):
    """What the window is started with; the folder has a TF, a slice, and files like commands."""
    starts: list[WindowStart] = []
    monkeypatch.setattr("app.launch.run_window", lambda start, *_: starts.append(start) or 0)
    monkeypatch.chdir(tmp_path)
    tf = TransferFunction(OpacityTF((0, 1)), ColorTF((0, 1), ((0, 0, 0, 0), (1, 1, 1, 1))))
    tf.save(tmp_path / "tf.json")
    (tmp_path / "scan").mkdir()
    (tmp_path / "IM0001").write_bytes(bytes(128) + b"DICM")
    for name in ("info", "cpu", "notes.txt"):
        (tmp_path / name).write_text("")
    return starts


@pytest.mark.parametrize(
    ("arguments", "start"),
    [
        ("", WindowStart(SCAN)),
        ("--renderer vtk", WindowStart(SCAN, renderer="vtk")),
        (str(VOLUME), WindowStart(VOLUME)),
        (f"--device cpu {VOLUME}", WindowStart(VOLUME)),
        (f"{VOLUME} --view=-30,20 --device cpu", WindowStart(VOLUME, view=View(-30, 20))),
        (f"--view -30,20 {VOLUME}", WindowStart(VOLUME, view=View(-30, 20))),
        (f"{VOLUME} tf.json", WindowStart(VOLUME, tf=Path("tf.json"))),
        ("tf.json", WindowStart(SCAN, tf=Path("tf.json"))),
        (f"{MODEL} --volume scan", WindowStart(Path("scan"), MODEL)),
        ("scan", WindowStart(Path("scan"))),
        ("IM0001", WindowStart(Path("IM0001"))),
        (
            "--lighting direct --light 10,-20 --renderer auto --crop 0,1,0,.5,0,1 --size 1400x900",
            WindowStart(
                SCAN,
                lighting="direct",
                light=LightDirection(10, -20),
                renderer="auto",
                crop=CropBox((0, 0, 0), (1, 0.5, 1)),
                size=(1400, 900),
            ),
        ),
    ],
)
def test_files_are_opened_by_what_they_are(opened, arguments, start):
    assert run(arguments.split()) == 0
    assert opened == [start]


def test_a_command_wins_over_a_file_of_its_name(opened, capsys):
    assert run(["info", str(VOLUME)]) == 0
    assert opened == []
    assert "lidc chest" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("rendr", "'rendr' is neither a command (dataset, desktop-entry,"),
        ("none.nrrd", "nor a file or folder that is there"),
        ("notes.txt", "notes.txt: this is a table or text, which is not read here"),
        (f"{VOLUME} {VOLUME}", "cannot both be opened by --volume"),
        (f"{VOLUME} render --out x.png", "Options before 'render' are the window's"),
        ("--model scan", "there is no model here"),
    ],
)
def test_what_cannot_be_opened_is_refused_in_a_line(opened, capsys, arguments, message):
    assert run(arguments.split()) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert message in line
    assert opened == []
