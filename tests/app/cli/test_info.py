import contextlib
import json
from pathlib import Path

import pytest

from app.cli import run
from app.cli.outputs import check_output, check_output_folder
from model.errors import TfscopeError
from model.volume_files.shipped import DEFAULT_VOLUME

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


@pytest.mark.parametrize(("file", "option", "value"), [
    ("tiff/imagej_2channels.tif", "--channel", "1"),
    ("vtk/b_cells_and_ids.vti", "--array", "vtkOriginalPointIds"),
    ("dicom/interleaved_acquisitions", "--series", "1"),
    ("folder/two_channels", "--series", "fused_ch01_z*.tif"),
])  # fmt: skip
def test_others_are_chosen(file, option, value, capsys):
    first = facts(capsys, str(CASES / file))["contents"]
    second = facts(capsys, str(CASES / file), option, value)["contents"]
    assert [content["is_read"] for content in first] == [True, False]
    assert [content["is_read"] for content in second] == [False, True]
    assert run(["info", str(CASES / file), option, "7"]) == 2
    assert f"no {option[2:]} '7'; there are" in capsys.readouterr().err


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


def test_files_that_cannot_be_written_are_refused_before_the_work(tmp_path):
    check_output(tmp_path / "new.json")
    (tmp_path / "old.json").write_text("{}")
    check_output(tmp_path / "old.json")
    with pytest.raises(TfscopeError, match="is a folder"):
        check_output(tmp_path)
    with pytest.raises(TfscopeError, match=r"old\.json is a file, not a folder"):
        check_output(tmp_path / "old.json" / "deep" / "x.json")
    with pytest.raises(TfscopeError, match="there is a file"):
        check_output_folder(tmp_path / "old.json")
    # Missing folders are made, but not before there is something to write.
    check_output(tmp_path / "none" / "deep" / "x.json")
    check_output_folder(tmp_path / "none" / "deep")
    assert [path.name for path in tmp_path.iterdir()] == ["old.json"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a full device of Linux")
@pytest.mark.parametrize("words", [["--version"], ["info", "DATA", "--json"], ["info", "x" * 300]])
def test_a_full_disk_or_too_long_a_name_is_one_line(words, capsys):
    words = [str(DEFAULT_VOLUME) if word == "DATA" else word for word in words]
    with Path("/dev/full").open("w") as full, contextlib.redirect_stdout(full):
        assert run(words) == 2
        with contextlib.suppress(OSError):
            full.close()
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "No space left" in said or "File name too long" in said
