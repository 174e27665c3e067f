"""Files that earlier versions have written are taken over; those here are theirs."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from app.state.preferences import Preferences
from app.state.sensitivity_state import Choices, NamedRegion
from app.state.session import Session
from app.state.settings import SessionSettings, Settings
from app.state.volume_memory import VolumeMemory
from model.scene.crop import CropBox
from model.scene.region import Outline
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View

FINGERPRINT = "0f" * 32
TF: dict[str, Any] = json.loads(
    """{"tfscope_tf": 1, "range": [100.0, 200.0], "opacity": {"modes": [{"mean": 130.0, "width":
    8.0, "amplitude": 0.5}]}, "color": {"stops": [[100.0, 0.0, 0.0, 0.0], [200.0, 1.0, 1.0,
    1.0]]}}"""
)
LOOK: dict[str, Any] = json.loads(
    """{"up_axis": "-y", "raw_layout": "ball_20x18x16_uint8", "view": [30.0, -20.0, 5.0, 1.5, 0.1,
    0.0], "lighting": "soft", "light": [-40.0, 30.0], "brightness": 1.25, "crop": [0.1, 0.2, 0.0,
    0.9, 1.0, 0.5], "draws_missing": true, "choice": "", "regions": [{"name": "ribs", "points":
    [[0.1, 0.1], [0.4, 0.1], [0.2, 0.5]]}], "active_region": "ribs", "region_count": 4,
    "value_scale": "logarithmic", "opacity_scale": "logarithmic", "visible": [110.0, 180.0]}"""
)
UNTOUCHED: dict[str, Any] = json.loads(
    """{"path": "/data/other.nrrd", "up_axis": "", "raw_layout": "", "models": [], "view": [],
    "lighting": "auto", "light": [], "brightness": null, "crop": [], "draws_missing": false,
    "choice": "", "regions": [], "active_region": "", "region_count": 0, "value_scale": "linear",
    "opacity_scale": "linear", "visible": []}"""
)
WINDOW: dict[str, Any] = json.loads(
    """{"drawing": "raycast", "stop": "fast", "reference_size": 300, "denoises": false, "legend":
    true, "scale_bar": true, "cube": false, "opacity_images": true, "hidden_panes":
    ["generator"], "swapped": true}"""
)
PREFERENCES: dict[str, Any] = json.loads(
    """{"tfscope_preferences": 2, "trackball": true, "colors_follow_modes": false, "last_folder":
    "/data", "window_geometry": "AdnQywAD", "splitters": {"editor": [290]}, "theme": "light",
    "single_keys": false, "recent_volumes": ["/data/ball.raw"], "recent_models": ["/data/model"],
    "recent_transfer_functions": ["/data/tf.json"], "recent_sessions": ["/data/a.tfscope"]}"""
)
SESSION: dict[str, Any] = json.loads(
    """{"tfscope_session": 1, "volume": {"path": "/data/ball.raw", "beside": "ball.raw",
    "fingerprint": "0f0f"}, "model": {"path": "/data/model", "beside": "model"}, "sensitivity":
    {"shown": true, "curve": true, "visible": true, "measure": "change", "engine": "automatic",
    "width": 9.0, "height": 0.05, "locked": true}, "band": [120.0, 140.0], "browsing": true}"""
)

EXPECTED = VolumeMemory(
    tf=TransferFunction(
        OpacityTF((100.0, 200.0), (GaussianMode(130.0, 8.0, 0.5),)),
        ColorTF((100.0, 200.0), ((100.0, 0.0, 0.0, 0.0), (200.0, 1.0, 1.0, 1.0))),
    ),
    up_axis="-y",
    raw_layout="ball_20x18x16_uint8",
    view=View(30.0, -20.0, 5.0, 1.5, 0.1, 0.0),
    lighting="soft",
    light=LightDirection(-40.0, 30.0),
    brightness=1.25,
    crop=CropBox((0.1, 0.2, 0.0), (0.9, 1.0, 0.5)),
    draws_missing=True,
    regions=(NamedRegion("ribs", Outline(((0.1, 0.1), (0.4, 0.1), (0.2, 0.5)))),),
    active_region="ribs",
    region_count=4,
    value_scale="logarithmic",
    opacity_scale="logarithmic",
    visible=(110.0, 180.0),
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A user's folder of the earlier version."""
    ball = {"path": "/data/ball.raw", "models": ["/data/model"], **LOOK}
    volumes = {FINGERPRINT: ball, "ab" * 32: UNTOUCHED}
    content = {**PREFERENCES, **WINDOW, "volumes": volumes}
    (tmp_path / "preferences.json").write_text(json.dumps(content, indent=1))
    tfs = tmp_path / "transfer_functions"
    tfs.mkdir()
    (tfs / f"{FINGERPRINT[:32]}.json").write_text(json.dumps(TF, indent=2))
    return tmp_path


def test_settings_and_volumes_are_taken_over(folder: Path) -> None:
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    for _ in range(2):
        # The second one reads what the first has written.
        preferences = Preferences(folder)
        assert preferences.start_problem == ""
        settings, written = preferences.settings, {**PREFERENCES, **WINDOW}
        for field in fields(Settings):
            if field.name in written and field.name != "splitters":
                expected = written[field.name]
                expected = tuple(expected) if isinstance(expected, list) else expected
                assert getattr(settings, field.name) == expected != field.default
        assert settings.splitters == {"editor": (290,)}
        assert preferences.refresh(FINGERPRINT) == preferences.refresh("ab" * 32) == ""
        memory = preferences.volume(FINGERPRINT)
        assert (memory.path, memory.models) == ("/data/ball.raw", ("/data/model",))
        assert {**vars(memory), "path": "", "models": ()} == vars(EXPECTED)
        assert preferences.volume_at(Path("/data/ball.raw")) == memory
        assert preferences.volume("ab" * 32) == VolumeMemory("/data/other.nrrd")
        preferences.set(legend=False)
        preferences.set(legend=True)
        preferences.note_volume(FINGERPRINT, up_axis="+y")
        preferences.note_volume(FINGERPRINT, up_axis="-y")
        preferences.finish()
        assert (folder / "settings.json").exists()
        assert "volumes" not in json.loads((folder / "settings.json").read_text())
    assert {path: path.read_bytes() for path in before} == before


def test_damage_in_them_costs_no_more_than_itself(folder: Path) -> None:
    path = folder / "preferences.json"
    content = json.loads(path.read_text())
    look = content["volumes"][FINGERPRINT]
    look |= {"view": [0.0, 0.0, 0.0, -1.0], "crop": 3, "light": ["x", None], "visible": [1.0]}
    look["regions"] += [7, {"name": "no corners", "points": []}]
    path.write_text(json.dumps({**content, "theme": 3}))
    preferences = Preferences(folder)
    assert preferences.settings.theme == "system" and preferences.settings.legend
    found = {**vars(preferences.volume(FINGERPRINT)), "path": "", "models": ()}
    lost = {"view": None, "crop": None, "light": None, "visible": None}
    assert found == {**vars(EXPECTED), **lost}
    for damaged in ("", "[]", '{"volumes": 3}', '{"volumes": {"a": 3}}'):
        path.write_text(damaged)
        assert Preferences(folder / "").volume(FINGERPRINT).tf == EXPECTED.tf


def test_sessions_are_opened(tmp_path: Path) -> None:
    path = tmp_path / "a.tfscope"
    content = {**SESSION, "transfer_function": TF, "look": LOOK, "window": WINDOW}
    path.write_text(json.dumps(content, indent=1))
    found = Session.load(path)
    assert (found.volume, found.model) == (Path("/data/ball.raw"), Path("/data/model"))
    assert (found.fingerprint, found.wrong) == ("0f0f", ())
    assert found.content.memory == EXPECTED
    settings = {**WINDOW, "hidden_panes": ("generator",)}
    assert found.content.settings == SessionSettings(**settings)
    assert found.content.sensitivity == Choices(measure="change", width=9.0, locked=True)
    assert (found.content.band, found.content.browsing) == ((120.0, 140.0), True)
    found.save(path)
    assert Session.load(path) == found
    # A light that was there once, nothing pinned, and a TF that is damaged.
    content |= {"look": {**LOOK, "lighting": "shadows"}, "band": [], "transfer_function": {}}
    path.write_text(json.dumps(content))
    found = Session.load(path)
    assert found.content.memory.lighting == "soft" and found.content.band is None
    assert found.content.memory.tf is None and found.wrong == ("tf",)
