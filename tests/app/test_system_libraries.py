from types import SimpleNamespace

from app import system_libraries


def test_nothing_is_missing_where_the_tests_run():
    # The Makefile has installed what was missing before it ran the tests.
    assert system_libraries.missing_packages() == []


def test_a_library_that_does_not_load_names_its_package(monkeypatch):
    real = system_libraries.ctypes.CDLL

    def without_egl(name):
        if "EGL" in name:
            raise OSError(name)
        return real(name)

    monkeypatch.setattr(system_libraries.ctypes, "CDLL", without_egl)
    assert system_libraries.missing_packages() == ["libegl-mesa0", "libegl1", "libgl1-mesa-dri"]


def test_without_rights_the_exact_command_is_printed(monkeypatch, capsys):
    monkeypatch.setattr(system_libraries, "_administrator", lambda: None)
    monkeypatch.setattr(system_libraries.shutil, "which", lambda name: f"/usr/bin/{name}")
    assert system_libraries.install(["libegl1", "libgl1"]) == 1
    printed = capsys.readouterr().err
    assert "sudo apt-get update && sudo apt-get install" in printed
    assert printed.rstrip().endswith("libegl1 libgl1")


def test_with_rights_apt_get_installs(monkeypatch):
    ran = []

    def record(command, **_):
        ran.append(command)
        return SimpleNamespace(returncode=0)

    monkeypatch.setattr(system_libraries, "_administrator", lambda: ["sudo", "-n"])
    monkeypatch.setattr(system_libraries.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(system_libraries.subprocess, "run", record)
    assert system_libraries.install(["libegl1"]) == 0
    assert ran[0][:4] == ["sudo", "-n", "apt-get", "update"]
    assert ran[1][:4] == ["sudo", "-n", "apt-get", "install"]
    assert ran[1][-1] == "libegl1"


def test_an_old_python_is_said(monkeypatch, capsys):
    monkeypatch.setattr(system_libraries.sys, "version_info", (3, 9, 2))
    assert system_libraries.main(["--python"]) == 1
    assert "make PYTHON=python3.11" in capsys.readouterr().err
