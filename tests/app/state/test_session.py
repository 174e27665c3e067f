"""The file of a session: what it holds, and what is said of one that cannot be opened."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ramp import make_tf

from app.state.known_volume import KnownRegion, KnownVolume
from app.state.remembered import Remembered
from app.state.sensitivity_state import Choices
from app.state.session import Session, SessionError, of_session

NOT_OF_A_SESSION = {
    # The file itself, and what is known of it beside the session.
    *("path", "models", "others", "volumes"),
    # Of this machine.
    # Habits and places of a person, whatever is looked at.
    *("trackball", "colors_follow_modes", "theme", "single_keys", "last_folder"),
    *("window_geometry", "splitters"),
    *("recent_volumes", "recent_models", "recent_transfer_functions", "recent_sessions"),
}
"""Fields that are remembered, and belong to no session."""

LOOK: dict[str, Any] = {
    "up_axis": "-y",
    "raw_layout": "ball_20x18x16_uint8",
    "view": (30.0, -20.0, 5.0, 1.5, 0.1, 0.0),
    "lighting": "soft",
    "light": (-40.0, 30.0),
    "brightness": 1.25,
    "crop": (0.1, 0.2, 0.0, 0.9, 1.0, 0.5),
    "draws_missing": True,
    "choice": "",
    "regions": (KnownRegion("ribs", ((0.1, 0.1), (0.4, 0.1), (0.2, 0.5))),),
    "active_region": "ribs",
    "region_count": 4,
    "value_scale": "logarithmic",
    "opacity_scale": "logarithmic",
    "visible": (110.0, 180.0),
}
WINDOW: dict[str, Any] = {
    "drawing": "raycast",
    "stop": "fast",
    "reference_size": 300,
    "denoises": False,
    "legend": True,
    "scale_bar": True,
    "cube": False,
    "opacity_images": True,
    "hidden_panes": ("generator",),
    "swapped": True,
}
"""None of them the usual value."""


def make_session(folder: Path) -> Session:
    volume = folder / "data" / "ball.nrrd"
    volume.parent.mkdir(exist_ok=True)
    volume.touch()
    return Session(
        volume=volume,
        fingerprint="0f" * 32,
        transfer_function=make_tf(),
        look=LOOK,
        window=WINDOW,
        sensitivity=Choices(measure="change", width=9.0, locked=True),
        band=(120.0, 140.0),
        browsing=True,
        model=folder / "data",
    )


def test_what_is_remembered_is_in_a_session_or_named_here() -> None:
    remembered = {each.name for kind in (KnownVolume, Remembered) for each in fields(kind)}
    usual = [of_session(each) for each in (KnownVolume(), Remembered(), Choices())]
    assert remembered == {*usual[0], *usual[1], *NOT_OF_A_SESSION}
    assert set(usual[2]) == {each.name for each in fields(Choices)}


def test_every_field_comes_back(tmp_path: Path) -> None:
    look, window = of_session(KnownVolume()), of_session(Remembered())
    usual = {**look, **window}
    for name, value in {**LOOK, **WINDOW}.items():
        assert value != usual[name] or name == "choice"
    session = make_session(tmp_path)
    session.save(tmp_path / "a.tfscope")
    assert Session.load(tmp_path / "a.tfscope") == session
    assert set(LOOK) == set(look) and set(WINDOW) == set(window)


def test_a_volume_that_moved_with_the_session_is_found(tmp_path: Path) -> None:
    before, after = tmp_path / "before", tmp_path / "after"
    before.mkdir()
    make_session(before).save(before / "a.tfscope")
    before.rename(after)
    found = Session.load(after / "a.tfscope")
    assert found.volume == after / "data" / "ball.nrrd" and found.model == after / "data"
    # Beside the session, too; else it stays where it was.
    (after / "data" / "ball.nrrd").rename(after / "ball.nrrd")
    assert Session.load(after / "a.tfscope").volume == after / "ball.nrrd"
    (after / "ball.nrrd").unlink()
    assert Session.load(after / "a.tfscope").volume == before / "data" / "ball.nrrd"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tfscope_session": 2}, "newer tfscope"),
        ({"tfscope_session": "1"}, "whole number"),
        ({"volume": "ball.nrrd"}, "'volume' must have names"),
        ({"volume": {"path": 3}}, "must be text"),
        ({"transfer_function": {}}, "transfer function|TF"),
        ({"look": {"view": [0, 0, 0, -1]}}, "'view' cannot be"),
        ({"look": {"crop": [0, 0, 0, 1, 1, 7]}}, "'crop' cannot be"),
        ({"look": []}, "'look' must have names"),
        ({"window": {"cube": 1}}, "'cube' cannot be 1"),
        ({"sensitivity": {"width": 1e9}}, "'width' cannot be"),
        ({"band": [3.0]}, "'band' must have"),
        ({"band": [3.0, 1.0]}, "'band' must have"),
        ({"browsing": "yes"}, "must be one of"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    path = tmp_path / "a.tfscope"
    make_session(tmp_path).save(path)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(SessionError, match=words) as caught:
        Session.load(path)
    assert str(path) in str(caught.value) and "nothing was changed" in str(caught.value)


def test_other_files_are_no_sessions(tmp_path: Path) -> None:
    path = tmp_path / "a.tfscope"
    with pytest.raises(SessionError, match="cannot be read"):
        Session.load(path)
    for content in (b"", b"[]", b"NRRD0004", b"\xff\xfe", b"{" * 9999, b'{"a": 1}'):
        path.write_bytes(content)
        with pytest.raises(SessionError, match="no session"):
            Session.load(path)
    with pytest.raises(SessionError, match="another place"):
        make_session(tmp_path).save(path / "b.tfscope")


def test_damaged_files_are_opened_or_refused(tmp_path: Path) -> None:
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
