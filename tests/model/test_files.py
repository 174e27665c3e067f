import re
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

from model import errors, json_files, metrics
from model.errors import EXTRAS, RenderError, TfscopeError
from model.files import write_atomically, writing
from model.json_files import MalformedError, build, parse_json, read_json
from model.rendering.movie_file import write_movie


@dataclass(frozen=True)
class Part:
    value: float


@dataclass(frozen=True)
class Whole:
    part: Part
    kind: Literal["a", "b"] = "a"
    place: Path | None = None
    pair: tuple[float, float] = (0.0, 1.0)
    count: int = 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"1" * 5000, "digits"), (b"[" * 200_000, "nested too deeply"),
        (b'{"a":' * 200_000, "nested too deeply"), (b'"\xff"', "not UTF-8"), (b"{", "Expecting"),
        (b"", "Expecting"),
    ],
)  # fmt: skip
def test_what_is_no_json_is_malformed(content, message):
    with pytest.raises(MalformedError, match=message):
        parse_json(content)


def test_a_byte_order_mark_is_skipped_and_names_of_files_come_back():
    assert parse_json(b'\xef\xbb\xbf["\\udce9"]') == ["\udce9"]


def test_a_longer_file_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(json_files, "MOST_BYTES", 10)
    path = tmp_path / "a.json"
    path.write_text("[1, 2, 3]")
    assert read_json(path) == [1, 2, 3]
    path.write_text("[1, 2, 3, 4]")
    with pytest.raises(MalformedError, match="longer than"):
        read_json(path)


def test_dataclasses_are_built_from_plain_data():
    data = {"part": {"value": 1}, "kind": "b", "place": "x/y", "pair": [2, 3]}
    assert build(Whole, data) == Whole(Part(1.0), "b", Path("x/y"), (2.0, 3.0))


@pytest.mark.parametrize(("data", "message"), [
    ([], "Expected object"), ({}, r"'part' \(it is missing"),
    ({"part": {}}, r"'part.value' \(it is missing"),
    ({"part": {"value": "1"}}, r"'part.value' \(Expected float, got str"),
    ({"part": {"value": 10**400}}, "out of range"), ({"part": {"value": True}}, "bool"),
    ({"part": {"value": 1}, "kind": "c"}, "'kind'"),
    ({"part": {"value": 1}, "place": 3}, "'place'"),
    ({"part": {"value": 1}, "pair": [1]}, "'pair'"),
    ({"part": {"value": 1}, "count": 1.5}, "'count'"),
    ({"part": {"value": 1}, "kind": "\udce9"}, "valid Unicode"),
])  # fmt: skip
def test_wrong_data_is_named(data, message):
    with pytest.raises(MalformedError, match=message):
        build(Whole, data)


def test_unknown_names_are_left_out_or_refused():
    data = {"part": {"value": 1}, "more": 2}
    assert build(Whole, data) == Whole(Part(1.0))
    with pytest.raises(MalformedError, match="'more'"):
        build(Whole, data, exact=True)


def test_a_failed_write_leaves_what_was_there(tmp_path):
    path = tmp_path / "result.txt"
    path.write_text("old")

    def write():
        with writing(path) as file:
            file.write(b"half of the ne")
            raise OSError("the disk is full")

    with pytest.raises(OSError, match="full"):
        write()
    assert [p.name for p in tmp_path.iterdir()] == ["result.txt"]
    assert path.read_text() == "old"


def test_a_link_stays_one_and_a_device_a_device(tmp_path):
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "target")
    write_atomically(link, b"new")
    assert link.is_symlink()
    assert (tmp_path / "target").read_bytes() == b"new"
    write_atomically(Path("/dev/null"), b"new")
    assert Path("/dev/null").is_char_device()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a full device")
def test_a_full_device_is_an_error():
    with pytest.raises(OSError, match="No space"):
        write_atomically(Path("/dev/full"), b"new")


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
