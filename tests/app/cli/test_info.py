import json
from pathlib import Path

import pytest
import tifffile

from app.cli import run

CASES = Path(__file__).parents[2] / "model" / "volume_files" / "cases"


def facts(capsys, *arguments):
    assert run(["info", "--json", *arguments]) == 0
    return json.loads(capsys.readouterr().out)


def test_all_that_is_known_as_data(capsys):
    path = CASES / "tiff" / "imagej_2channels.tif"
    found = facts(capsys, str(path))
    assert found["dimensions"] == [28, 20, 12]
    assert (found["type"], found["spacing"]) == ("uint16", [0.5, 0.5, 2.0])
    assert (found["spacing_unit"], found["range"]) == ("um", [200.0, 2400.0])
    assert found["missing_share"] == 0
    contents = found["contents"]
    assert [(c["kind"], c["name"], c["is_read"]) for c in contents] == [
        ("channel", "0", True),
        ("channel", "1", False),
    ]


def test_a_channel_is_chosen(capsys):
    path = CASES / "tiff" / "imagej_2channels.tif"
    found = facts(capsys, str(path), "--channel", "1")
    whole = tifffile.imread(path)[:, 1]
    assert found["range"] == [float(whole.min()), float(whole.max())]
    assert run(["info", str(path), "--channel", "7"]) == 2
    assert "there is no channel '7'; there are 0, 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "option", "value"),
    [
        ("vtk/b_cells_and_ids.vti", "--array", "vtkOriginalPointIds"),
        ("dicom/interleaved_acquisitions", "--series", "1"),
        ("folder/two_channels", "--series", "fused_ch01_z*.tif"),
    ],
)
def test_others_are_chosen(file, option, value, capsys):
    first = facts(capsys, str(CASES / file))["contents"]
    second = facts(capsys, str(CASES / file), option, value)["contents"]
    assert [content["is_read"] for content in first] == [True, False]
    assert [content["is_read"] for content in second] == [False, True]


def test_directions_and_units_of_a_patient(capsys):
    found = facts(capsys, str(CASES / "dicom" / "padding_signed"))
    assert (found["units"], found["space"]) == ("HU", "LPS")
    assert found["directions"] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert any("missing" in note for note in found["notes"])


def test_a_spacing_is_typed(capsys):
    path = CASES / "tiff" / "numpy_4d.tif"
    found = facts(capsys, str(path), "--spacing", "0.5,0.5,2 um")
    assert (found["spacing"], found["spacing_unit"]) == ([0.5, 0.5, 2.0], "um")
    assert not any("assumed" in note for note in found["notes"])
    assert run(["info", str(path), "--spacing", "1,2"]) == 2
    assert "'1,2' is not a voxel spacing" in capsys.readouterr().err


def test_render_says_what_the_reader_assumed(tmp_path, capsys):
    path = CASES / "tiff" / "numpy_4d.tif"
    arguments = f"render --out {tmp_path}/a.png --volume {path} --size 16"
    assert run(arguments.split()) == 0
    assert "tfscope: The file gives no voxel spacing" in capsys.readouterr().err
