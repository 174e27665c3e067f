import os
import subprocess
from itertools import pairwise
from types import SimpleNamespace

import pytest

from app import python_packages


def test_settings_are_those_of_pip_variables_before_files(monkeypatch, tmp_path):
    indices = "https://a.example/x", "https://b.example/x"
    file = tmp_path / "pip.conf"
    file.write_text(
        "[global]\nfind-links = /from/file\nextra-index-url = " + "\n    ".join(indices)
    )
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", str(file))
    monkeypatch.setenv("PIP_FIND_LINKS", "/from/variable")
    settings = python_packages.pip_settings()
    assert settings["find-links"] == "/from/variable"
    options = python_packages.uv_options(settings, has_nvidia=False)
    pairs = list(pairwise(options))
    assert [each for name, each in pairs if name == "--extra-index-url"] == list(indices)
    assert ("--find-links", "/from/variable") in pairs and "--torch-backend" not in options


@pytest.mark.parametrize("has_nvidia", [True, False])
def test_without_settings_only_an_nvidia_gpu_brings_cuda(has_nvidia):
    options = python_packages.uv_options({}, has_nvidia)
    assert options == ([] if has_nvidia else ["--torch-backend", "cpu"])


@pytest.mark.parametrize("failing", ["--target", "--python"])
def test_where_uv_cannot_be_had_or_fails_pip_installs(failing, monkeypatch):
    ran = []

    def record(command, **_):
        ran.append(list(command))
        return SimpleNamespace(returncode=int(failing in command), stdout="")

    monkeypatch.setattr(subprocess, "run", record)
    assert python_packages.main(["torch==2.13.0", "--editable", "."]) == 0
    assert ran[-1][:4] == [*python_packages.PIP]
    assert ran[-1][-3:] == ["torch==2.13.0", "--editable", "."]
