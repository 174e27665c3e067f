from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from app.state import delayed_writer
from app.state.known_volume import MOST_RECENT, KnownVolume
from app.state.preferences import Preferences, PreferencesStore
from app.state.remembered import Remembered


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> PreferencesStore:
    monkeypatch.setattr(delayed_writer, "PAUSE_MS", 10)
    return PreferencesStore(tmp_path / "not" / "there" / "preferences.json")


def written(store: PreferencesStore, content: object) -> Path:
    store.path.parent.mkdir(parents=True)
    store.path.write_text(content if isinstance(content, str) else json.dumps(content))
    return store.path


OTHER_VALUES: dict[str, Any] = {
    "drawing": "raycast",
    "stop": "exact",
    "reference_size": 1024,
    "denoises": False,
    "trackball": True,
    "colors_follow_modes": False,
    "legend": True,
    "scale_bar": True,
    "cube": False,
    "opacity_images": True,
    "last_folder": "/data",
    "window_geometry": "AdnQywAD",
    "splitters": {"main": (500, 290)},
    "hidden_panes": ("generator",),
    "swapped": True,
    "theme": "light",
    "single_keys": False,
    "recent_volumes": ("/data/a.nrrd", "/data/ü \udce9.nrrd"),
    "recent_models": ("/data/model",),
    "recent_transfer_functions": ("/data/tf.json",),
    "recent_sessions": ("/data/a.tfscope",),
    "volumes": {
        "f1": KnownVolume(
            "/data/a.raw",
            "-y",
            "8x8x8_uint8",
            ("/data/model",),
            (),
            "soft",
            (50.0, -20.0),
            1.5,
            (0.1, 0.0, 0.0, 1.0, 0.5, 1.0),
        )
    },
}


def test_everything_is_there_in_the_next_run(store: PreferencesStore) -> None:
    assert set(OTHER_VALUES) == {each.name for each in fields(Remembered)} - {"others"}
    first = Preferences(store)
    for name, value in OTHER_VALUES.items():
        assert first.value(name) != value
        first.set(**{name: value})
    first.finish()
    again = Preferences(store)
    assert {name: again.value(name) for name in OTHER_VALUES} == OTHER_VALUES
    assert again.start_problem == ""


WRONG_VALUES: list[Any] = [-3.5, -7, 10**400, "no such", True, [1], {"a": 1}, float("nan"), None]


@pytest.mark.parametrize("wrong", WRONG_VALUES)
def test_a_wrong_value_is_its_default_and_spoils_no_other(wrong: Any) -> None:
    good = json.loads(json.dumps(Remembered(**OTHER_VALUES).to_json()))
    for name in OTHER_VALUES:
        found = Remembered.from_json({**good, name: wrong})
        for other, value in OTHER_VALUES.items():
            if other != name:
                assert getattr(found, other) == value
        value, default = getattr(found, name), getattr(Remembered(), name)
        # Some are valid: texts for a folder, for example.
        assert value == default or (value == wrong and type(value) is type(default))


def test_what_a_newer_version_has_written_is_kept(store: PreferencesStore) -> None:
    volumes = {"f1": {"path": "/a", "notes": "mine"}}
    path = written(store, {"tfscope_preferences": 3, "theme": "light", "volumes": volumes})
    preferences = Preferences(store)
    preferences.set(legend=True)
    preferences.note_volume("f1", up_axis="+y")
    preferences.finish()
    found = json.loads(path.read_text())
    assert (found["theme"], found["legend"]) == ("light", True)
    assert (found["volumes"]["f1"]["notes"], found["volumes"]["f1"]["up_axis"]) == ("mine", "+y")


@pytest.mark.parametrize("content", ["", "{", '{"a": 1}', "[1]", "\x00\x01", "[" * 100_000])
def test_a_damaged_or_foreign_file_is_set_aside_and_told(
    store: PreferencesStore, content: str
) -> None:
    path = written(store, content)
    preferences = Preferences(store)
    assert str(path) in preferences.start_problem
    assert preferences.values == Remembered()
    assert [p.read_text() for p in path.parent.iterdir()] == [content]
    preferences.set(legend=True)
    preferences.finish()
    assert Preferences(store).value("legend") is True
    path.write_text("damaged again")
    assert Preferences(store).start_problem
    aside = {p.read_text() for p in path.parent.glob("*.damaged")}
    assert aside == {content, "damaged again"}


def test_a_file_that_cannot_be_read_is_not_overwritten(
    store: PreferencesStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(store, Remembered(legend=True).to_json())

    def locked(*_: object, **__: object) -> str:
        raise PermissionError(13, "Permission denied")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", locked)
        preferences = Preferences(store)
    assert "Permission denied" in preferences.start_problem
    preferences.set(cube=False)
    preferences.finish()
    assert Preferences(store).values == Remembered(legend=True)
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_wrong_change_is_refused() -> None:
    preferences = Preferences()
    for changes in ({"drawing": "dim"}, {"stop": "slow"}, {"lightning": "none"}):
        with pytest.raises(ValueError, match=next(iter(changes))):
            preferences.set(**changes)
    with pytest.raises(ValueError, match="up_axis"):
        preferences.note_volume("a", up_axis="up")
    assert preferences.values == Remembered()


def test_recent_files_are_the_newest_ones_each_once(tmp_path: Path) -> None:
    preferences = Preferences()
    files = [tmp_path / "data" / f"{n}.json" for n in range(MOST_RECENT + 2)]
    for path in [*files, files[5]]:
        preferences.note_transfer_function(path)
    expected = [files[5], *(p for p in reversed(files) if p != files[5])][:MOST_RECENT]
    assert preferences.recent("transfer_functions") == expected
    assert preferences.value("last_folder") == str(tmp_path / "data")
    preferences.forget_recent("transfer_functions")
    assert preferences.recent("transfer_functions") == []
