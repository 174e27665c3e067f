import os
from pathlib import Path

import pytest

from app.cli.outputs import check_outputs, write_json
from model.errors import TfscopeError


def test_files_that_cannot_be_written_are_refused_before_the_work(tmp_path: Path) -> None:
    check_outputs(None, tmp_path / "new.json")
    (tmp_path / "old.json").write_text("{}")
    check_outputs(tmp_path / "old.json", None)
    with pytest.raises(TfscopeError, match="is a folder"):
        check_outputs(tmp_path)
    with pytest.raises(TfscopeError, match=r"x\.json: .* there is no folder .*none"):
        check_outputs(tmp_path / "fine.json", tmp_path / "none" / "x.json")
    assert not (tmp_path / "fine.json").exists()


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write everywhere")
def test_places_without_permission_are_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(TfscopeError, match="not allowed"):
        check_outputs(tmp_path / "x.json")
    tmp_path.chmod(0o700)


def test_json_is_written_with_its_numbers(tmp_path: Path) -> None:
    write_json(tmp_path / "x.json", {"a": 0.5})
    assert (tmp_path / "x.json").read_text() == '{\n  "a": 0.5\n}\n'
    with pytest.raises(TfscopeError, match="cannot be written"):
        write_json(tmp_path / "none" / "x.json", {})
