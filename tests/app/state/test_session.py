import json
from contextlib import suppress
from dataclasses import asdict, fields, replace

import numpy as np
import pytest
from kept_values import MEMORY, SETTINGS

from app.state.sensitivity_state import Choices
from app.state.session import Session, SessionContent, SessionError
from app.state.settings import SessionSettings, VolumeMemory, part_of

CONTENT = SessionContent(
    replace(MEMORY, path="", models=()),
    part_of(SETTINGS, SessionSettings),
    Choices(False, False, True, False, "change", "exact", 9.0, 0.1, True),
    (120.0, 140.0),
    True,
)
"""None of them the usual value."""


def make_session(folder):
    volume = folder / "data" / "ball.nrrd"
    volume.parent.mkdir(exist_ok=True)
    volume.touch()
    return Session(volume, "0f" * 32, CONTENT, folder / "data")


def test_every_field_comes_back(tmp_path):
    usual = SessionContent()
    for part, kind in ((CONTENT, usual), *((getattr(CONTENT, n), getattr(usual, n))
                       for n in ("memory", "settings", "sensitivity"))):  # fmt: skip
        same = {f.name for f in fields(part) if getattr(part, f.name) == getattr(kind, f.name)}
        # These are of the machine that it was saved on.
        assert same == ({"path", "models"} if isinstance(part, VolumeMemory) else set())
    session = make_session(tmp_path)
    session.save(tmp_path / "a.tfscope")
    assert Session.load(tmp_path / "a.tfscope") == session


def test_a_volume_that_moved_with_the_session_is_found(tmp_path):
    before, after = tmp_path / "before", tmp_path / "after"
    before.mkdir()
    make_session(before).save(before / "a.tfscope")
    before.rename(after)
    found = Session.load(after / "a.tfscope")
    assert found.volume == after / "data" / "ball.nrrd" and found.model == after / "data"
    # Beside the session, too; else it stays where it was.
    (after / "data" / "ball.nrrd").rename(after / "ball.nrrd")
    assert Session.load(after / "a.tfscope").volume == after / "ball.nrrd"
    data = json.loads((after / "a.tfscope").read_text())
    data["volume"] = {"path": r"C:\data\ball.nrrd", "beside": "", "fingerprint": "0f"}
    (after / "b.tfscope").write_text(json.dumps(data))
    assert Session.load(after / "b.tfscope").volume == after / "ball.nrrd"
    (after / "ball.nrrd").unlink()
    assert Session.load(after / "a.tfscope").volume == before / "data" / "ball.nrrd"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tfscope_session": 3}, "newer tfscope"),
        ({"tfscope_session": "1"}, "does not hold a session"),
        ({"volume": "ball.nrrd"}, "Expected object"),
        ({"volume": {"path": 3}}, "'path'"),
        ({"model": []}, "Expected object"),
    ],
)
def test_what_is_no_session_is_refused(tmp_path, change, words):
    path = tmp_path / "a.tfscope"
    make_session(tmp_path).save(path)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(SessionError, match=words) as caught:
        Session.load(path)
    assert str(path) in str(caught.value) and "nothing was changed" in str(caught.value)


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [
        ("memory", "tf", {}), ("memory", "view", {"distance": -1}),
        ("memory", "crop", {"low": [0, 0, 0], "high": [1, 1, 7]}),
        ("memory", "clip", {"normal": [0, 0, 0], "offset": 0.5}), ("settings", "cube", 1),
        ("sensitivity", "width", 1e9), ("", "memory", []), ("", "band", [3.0]),
        ("", "browsing", "yes"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_and_costs_no_more(tmp_path, part, name, value):
    path = tmp_path / "a.tfscope"
    make_session(tmp_path).save(path)
    data = json.loads(path.read_text())
    (data[part] if part else data)[name] = value
    path.write_text(json.dumps(data))
    found = Session.load(path)
    assert found.wrong == (name,)
    usual, expected = asdict(SessionContent()), asdict(CONTENT)
    (expected[part] if part else expected)[name] = (usual[part] if part else usual)[name]
    assert asdict(found.content) == expected


def test_other_files_are_no_sessions(tmp_path):
    path = tmp_path / "a.tfscope"
    with pytest.raises(SessionError, match="cannot be read"):
        Session.load(path)
    for content in (b"", b"[]", b"NRRD0004", b"\xff\xfe", b"{" * 9999, b'{"a": 1}'):
        path.write_bytes(content)
        with pytest.raises(SessionError, match="no session"):
            Session.load(path)
    with pytest.raises(SessionError, match="another place"):
        make_session(tmp_path).save(path / "b.tfscope")


def test_damaged_files_are_opened_or_refused(tmp_path):
    path = tmp_path / "a.tfscope"
    make_session(tmp_path).save(path)
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    for _ in range(300):
        content = bytearray(whole)
        for place in rng.integers(len(whole), size=rng.integers(1, 4)):
            content[place] = rng.integers(256)
        if rng.random() < 0.3:
            del content[rng.integers(len(content)) :]
        path.write_bytes(content)
        with suppress(SessionError):
            Session.load(path)
