"""The scripts that install what tfscope needs, and a library that must not be loaded."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest


def script(name):
    path = Path(__file__).parent.parent / ".ci" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


python_packages, system_libraries = script("python_packages"), script("system_libraries")


def test_settings_are_those_of_pip_variables_before_files(monkeypatch, tmp_path):
    file = tmp_path / "pip.conf"
    file.write_text(
        "[global]\nfind-links = /from/file\nextra-index-url = https://a.example/x\n"
        "    https://b.example/x\n"
    )
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", str(file))
    monkeypatch.setenv("PIP_FIND_LINKS", "/from/variable")
    settings = python_packages.pip_settings()
    assert settings["find-links"] == "/from/variable"
    options = python_packages.uv_options(settings, has_nvidia=False)
    start, option = options.index("--extra-index-url"), "--extra-index-url"
    expected = [option, "https://a.example/x", option, "https://b.example/x"]
    assert options[start : start + 4] == expected
    assert options[options.index("--find-links") + 1] == "/from/variable"
    assert "--torch-backend" not in options


@pytest.mark.parametrize("has_nvidia", [True, False])
def test_without_settings_only_an_nvidia_gpu_brings_cuda(has_nvidia):
    options = python_packages.uv_options({}, has_nvidia)
    assert options == ([] if has_nvidia else ["--torch-backend", "cpu"])


@pytest.mark.parametrize("failing", ["--target", "--python"])
def test_where_uv_cannot_be_had_or_fails_pip_installs(failing, monkeypatch):
    ran: list[list[str]] = []

    def record(command, **_):
        ran.append(list(command))
        return SimpleNamespace(returncode=int(failing in command), stdout="")

    monkeypatch.setattr(subprocess, "run", record)
    assert python_packages.main(["torch==2.13.0", "--editable", "."]) == 0
    assert ran[-1][:4] == [*python_packages.PIP]
    assert ran[-1][-3:] == ["torch==2.13.0", "--editable", "."]


def test_a_library_that_does_not_load_names_its_package(monkeypatch):
    real = system_libraries.ctypes.CDLL

    def without_egl(name):
        if "EGL" in name:
            raise OSError(name)
        return real(name)

    monkeypatch.setattr(system_libraries.ctypes, "CDLL", without_egl)
    assert system_libraries.missing_packages() == ["libegl-mesa0", "libegl1", "libgl1-mesa-dri"]


@pytest.mark.parametrize("with_rights", [True, False])
def test_apt_get_installs_or_the_exact_command_is_printed(monkeypatch, capsys, with_rights):
    ran: list[list[str]] = []

    def record(command, **_):
        ran.append(command)
        return SimpleNamespace(returncode=0)

    administrator = ["sudo", "-n"] if with_rights else None
    monkeypatch.setattr(system_libraries, "_administrator", lambda: administrator)
    monkeypatch.setattr(system_libraries.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(system_libraries.subprocess, "run", record)
    assert system_libraries.install(["libegl1"]) == (not with_rights)
    if with_rights:
        wanted = [["sudo", "-n", "apt-get", verb] for verb in ("update", "install")]
        assert [command[:4] for command in ran] == wanted
        assert ran[1][-1] == "libegl1"
    else:
        printed = capsys.readouterr().err
        assert "sudo apt-get update && sudo apt-get install" in printed
        assert printed.rstrip().endswith("libegl1")


def test_an_optimizer_loads_no_triton_into_a_process_that_vtk_draws_in(tmp_path):
    (tmp_path / "triton.py").write_text("import os; os._exit(139)")
    code = "import model, torch; torch.optim.Adam([torch.nn.Parameter(torch.ones(1))])"
    path = os.pathsep.join((str(tmp_path), str(Path(__file__).parents[1])))
    subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": path}, check=True)
