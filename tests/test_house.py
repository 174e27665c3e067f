"""Rules of the house that no linter knows."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


def imported(path):
    """Names of the modules that a file imports anywhere."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found


@pytest.mark.parametrize("package", ["engines", "state"])
def test_engines_and_state_know_no_widget(package):
    paths = sorted((ROOT / "app" / package).glob("*.py"))
    assert len(paths) > 2
    for path in paths:
        assert "PySide6.QtWidgets" not in imported(path), path


def test_few_modules_are_loose_in_the_model():
    loose = [p.name for p in (ROOT / "model").glob("*.py") if p.name != "__init__.py"]
    assert len(loose) <= 8, loose


@pytest.mark.parametrize("package", ["app", "model"])
def test_a_module_has_at_most_500_lines(package):
    modules = sorted((ROOT / package).rglob("*.py"))
    assert modules
    for path in modules:
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 500, path


def test_few_signals_and_short_constructors():
    trees = {path: ast.parse(path.read_text("utf-8")) for path in (ROOT / "app").rglob("*.py")}
    nodes = [(path, node) for path, tree in trees.items() for node in ast.walk(tree)]
    made = [node for _, node in nodes if isinstance(node, ast.Call)]
    assert 0 < sum(isinstance(m.func, ast.Name) and m.func.id == "Signal" for m in made) <= 105
    for path, node in nodes:
        if isinstance(node, ast.FunctionDef) and node.name == "__init__":
            taken = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            assert len(taken) <= 1 + 6, f"{path}:{node.lineno}"
