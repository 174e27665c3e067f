import configparser
import sys
from importlib.metadata import version
from pathlib import Path

from app.cli import run


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
