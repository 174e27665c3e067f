import ast
import os
import tempfile
from pathlib import Path

import pytest

import model
from model import kernel_cache

ROOT = Path(model.__file__).parent
COMPILERS = {"compiled", "inlined"}


def imported(file):
    """Modules of model/, as paths in it, and the names that a file takes from them."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("model."):
            assert node.module is not None
            for name in node.names:
                yield node.module.removeprefix("model.").replace(".", "/") + ".py", name.name


def is_hashed(module):
    return any(module == place or module.startswith(f"{place}/") for place in kernel_cache.SOURCES)


def kernels():
    found = []
    for file in ROOT.rglob("*.py"):
        if COMPILERS & {name for _, name in imported(file)}:
            found.append(file)
    return found


def test_whatever_is_compiled_has_its_source_in_the_folders_name():
    # Numba itself notices only changes of the file with the outermost function.
    files = kernels()
    assert len(files) > 10
    assert [f for f in files if not is_hashed(f.relative_to(ROOT).as_posix())] == []


def test_constants_of_kernels_are_of_hashed_modules():
    foreign = {
        (module, name)
        for file in kernels()
        for module, name in imported(file)
        if name.isupper() and not is_hashed(module)
    }
    assert foreign == set()


def sources_in(folder, monkeypatch):
    """Write other sources to a folder, as of another checkout, and use them."""
    for source in kernel_cache.SOURCES:
        copy = folder / source
        copy = copy if source.endswith(".py") else copy / "kernel.py"
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text("A = 1")
    monkeypatch.setattr(kernel_cache, "__file__", str(folder / "kernel_cache.py"))


@pytest.mark.parametrize("place", kernel_cache.SOURCES)
def test_each_source_changes_the_folder(place, tmp_path, monkeypatch):
    sources_in(tmp_path, monkeypatch)
    before = kernel_cache.kernel_folder()
    assert kernel_cache.kernel_folder() == before
    changed = tmp_path / place
    changed = changed if changed.is_file() else changed / "kernel.py"
    changed.write_text("A = 2")
    assert kernel_cache.kernel_folder() != before


def test_a_copy_of_the_sources_is_not_prepared_as_numba_compiles_it_anew(tmp_path, monkeypatch):
    monkeypatch.setenv(kernel_cache.RUN_FOLDER, str(tmp_path))
    group = kernel_cache.KernelGroup("uint8", "soft", "images")
    sources_in(tmp_path / "a", monkeypatch)
    kernel_cache.kernel_folder().mkdir()
    group.note_prepared()
    assert group.is_prepared
    sources_in(tmp_path / "b", monkeypatch)
    assert kernel_cache.kernel_folder().exists()
    assert not group.is_prepared


def test_without_a_folder_to_write_kernels_are_kept_while_the_program_runs(tmp_path, monkeypatch):
    monkeypatch.setenv(kernel_cache.RUN_FOLDER, "")
    monkeypatch.setattr(kernel_cache, "cache_folder", lambda: Path(os.devnull))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    assert kernel_cache.keeps_kernels()
    folder = kernel_cache.kernel_folder()
    assert folder.is_dir()
    assert tmp_path in folder.parents
    # Processes find it by the environment; asked again, it stays.
    assert os.environ[kernel_cache.RUN_FOLDER] == str(folder.parent)
    assert kernel_cache.keeps_kernels()
    assert kernel_cache.kernel_folder() == folder
    monkeypatch.setenv(kernel_cache.RUN_FOLDER, "")
    monkeypatch.setattr(tempfile, "tempdir", os.devnull)
    assert not kernel_cache.keeps_kernels()
