import configparser
import contextlib
import os
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from app.cli import run
from app.cli.outputs import check_output, check_output_folder, write_json
from model.errors import TfscopeError
from model.volume_files.shipped import DEFAULT_VOLUME


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


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write everywhere")
def test_places_without_permission_are_refused(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(TfscopeError, match="not allowed"):
        check_output(tmp_path / "x.json")
    tmp_path.chmod(0o700)


def test_json_is_written_with_its_numbers(tmp_path):
    write_json(tmp_path / "x.json", {"a": 0.5})
    assert (tmp_path / "x.json").read_text() == '{\n  "a": 0.5\n}\n'
    write_json(tmp_path / "none" / "deep" / "x.json", {})
    assert (tmp_path / "none" / "deep" / "x.json").read_text() == "{}\n"
    with pytest.raises(TfscopeError, match="folder cannot be made"):
        write_json(tmp_path / "x.json" / "y.json", {})


def test_the_entry_opens_a_file_and_has_an_icon(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(sys, "argv", ["/opt/with space/tfscope"])
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert run(["desktop-entry"]) == 0
    parser = configparser.ConfigParser(interpolation=None)
    parser.read(tmp_path / "applications" / "tfscope.desktop")
    entry = parser["Desktop Entry"]
    assert entry["Exec"] == '"/opt/with space/tfscope" %f'
    assert Path(entry["Icon"]).is_file()


def test_the_version_is_that_of_the_package(capsys):
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"tfscope {version('tfscope')}\n"


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
