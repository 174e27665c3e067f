from __future__ import annotations

from pathlib import Path

import pytest
from ramp import make_tf

from app.state.transfer_function_keeper import TransferFunctionStore
from model.errors import TransferFunctionError


def test_a_damaged_file_is_told_once_and_set_aside(tmp_path: Path) -> None:
    store = TransferFunctionStore(tmp_path)
    path = store.path("a" * 64)
    path.write_text("not json")
    with pytest.raises(TransferFunctionError, match=path.stem):
        store.load("a" * 64)
    assert store.load("a" * 64) is None
    assert [p.read_text() for p in tmp_path.iterdir()] == ["not json"]
    # Another one does not replace it.
    path.write_text("not json either")
    with pytest.raises(TransferFunctionError):
        store.load("a" * 64)
    assert sorted(p.read_text() for p in tmp_path.iterdir()) == ["not json", "not json either"]


def test_what_cannot_be_read_is_not_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = TransferFunctionStore(tmp_path)
    store.save("a" * 64, make_tf(120.0))

    def locked(*_: object, **__: object) -> str:
        raise PermissionError(13, "Permission denied")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", locked)
        with pytest.raises(TransferFunctionError, match="Permission denied"):
            store.load("a" * 64)
    assert store.load("a" * 64) == make_tf(120.0)


def test_a_place_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(TransferFunctionError, match="file"):
        TransferFunctionStore(blocker / "folder").save("a" * 64, make_tf())
