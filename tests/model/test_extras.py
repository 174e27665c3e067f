"""Optional packages: known by the extras of pyproject.toml, and asked for by a command."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

from model import errors, metrics
from model.errors import EXTRAS, RenderError, TfscopeError
from model.rendering.movie_file import write_movie

ROOT = Path(__file__).parents[2]


def test_extras_have_the_packages_of_the_project_file():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = project["optional-dependencies"]
    for extra, modules in EXTRAS.items():
        names = [re.split("[<>=]", each)[0] for each in declared[extra]]
        assert list(modules.values()) == names
        assert not any(each.startswith(tuple(names)) for each in project["dependencies"])
    assert declared["test"][0] == f"tfscope[{','.join(EXTRAS)}]"


def test_what_is_missing_is_asked_for_with_its_command(monkeypatch, tmp_path):
    monkeypatch.setattr(errors, "find_spec", lambda module: None)
    command = re.escape(f"{sys.executable} -m pip install POT flip-evaluator scikit-learn")
    with pytest.raises(TfscopeError, match=f"POT and .* must be installed by: {command}$"):
        metrics.color_emd(None, None)
    with pytest.raises(RenderError, match=r"pip install imageio-ffmpeg, or choose \.gif"):
        write_movie(tmp_path / "turn.mp4", [], 25)
