import os

import pytest

from app.cli.outputs import check_output, check_output_folder, write_json
from model.errors import TfscopeError


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
