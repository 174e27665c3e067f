import json
import threading
from dataclasses import asdict, fields
from pathlib import Path
from unittest.mock import Mock

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from kept_values import MEMORY, SETTINGS, region
from ramp import make_tf

from app.state import preferences as preferences_module
from app.state.preferences import MOST_RECENT, Preferences, settings_file, volume_file
from app.state.settings import Settings, VolumeMemory
from model.json_files import build_valid
from model.scene.view import View
from model.volume_files.shipped import SCAN


@pytest.fixture(autouse=True)
def short_pause(monkeypatch):
    monkeypatch.setattr(preferences_module, "PAUSE_MS", 10)


def test_everything_is_there_in_the_next_run(tmp_path):
    folder = tmp_path / "not" / "there"
    for each in (SETTINGS, MEMORY):
        usual = type(each)()
        assert not [f.name for f in fields(each) if getattr(each, f.name) == getattr(usual, f.name)]
    first = Preferences(folder)
    first.set(**vars(SETTINGS))
    first.note_volume("f1", **vars(MEMORY))
    first.finish()
    again = Preferences(folder)
    assert (again.settings, again.volume("f1")) == (SETTINGS, MEMORY)
    assert again.volume_at(Path("/data/a.nrrd")) == MEMORY
    assert again.volume("f2") == again.volume_at(Path("/data/b.nrrd")) == VolumeMemory()
    assert again.start_problem == again.refresh("f1") == ""


WRONG_VALUES = [
    *(-3.5, -7, 10**400, "no such", True, [1], {"a": 1}, float("nan"), float("inf"), None),
    *("\udce9", [[[[]]]], [{"name": "x", "outline": {"points": [[0, 0], [1, 1], [5e9, 0]]}}]),
]


@pytest.mark.parametrize("wrong", WRONG_VALUES)
@pytest.mark.parametrize("good", [SETTINGS, MEMORY])
def test_a_wrong_value_is_its_default_and_spoils_no_other(good, wrong):
    kind, usual = type(good), type(good)()
    data = json.loads(json.dumps(asdict(good)))
    for name in data:
        found, told = build_valid(kind, {**data, name: wrong})
        for other in data:
            if other != name:
                assert getattr(found, other) == getattr(good, other)
        value = getattr(found, name)
        if told:
            # Of lists, what can be used stays.
            assert told == [name]
            assert value in (getattr(usual, name), ())
        elif type(wrong) is not dict:
            # Some are valid: texts for a folder, for example.
            assert value == wrong and type(value) is type(wrong)


def test_what_is_damaged_in_a_file_is_told_and_the_rest_is_there(tmp_path):
    first = Preferences(tmp_path)
    first.note_volume("f1", **vars(MEMORY))
    first.finish()
    path = tmp_path / "volumes" / "f1.json"
    data = json.loads(path.read_text())
    path.write_text(json.dumps({**data, "tf": 3, "notes": "of a newer version"}))
    again = Preferences(tmp_path)
    told = again.refresh("f1")
    assert str(path) in told and "'tf'" in told
    assert asdict(again.volume("f1")) == {**asdict(MEMORY), "tf": None}
    again.note_volume("f1", up_axis="+y")
    again.finish()
    found = json.loads(path.read_text())
    assert (found["notes"], found["up_axis"]) == ("of a newer version", "+y")


@pytest.mark.parametrize("content", ["", "{", '{"a": 1}', "[1]", "\x00\x01", "[" * 100_000])
def test_a_damaged_or_foreign_file_is_set_aside_and_told(tmp_path, content):
    path = tmp_path / "settings.json"
    path.write_text(content)
    preferences = Preferences(tmp_path)
    assert str(path) in preferences.start_problem
    assert preferences.settings == Settings()
    assert [p.read_text() for p in path.parent.iterdir()] == [content]
    preferences.set(legend=True)
    preferences.finish()
    assert Preferences(tmp_path).settings.legend
    path.write_text("damaged again")
    assert Preferences(tmp_path).start_problem
    aside = {p.read_text() for p in path.parent.glob("*.damaged")}
    assert aside == {content, "damaged again"}


def test_a_file_that_cannot_be_read_is_not_overwritten(tmp_path, monkeypatch):
    first = Preferences(tmp_path)
    first.set(legend=True)
    first.finish()
    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", Mock(side_effect=PermissionError(13, "Permission denied")))
        preferences = Preferences(tmp_path)
    assert "Permission denied" in preferences.start_problem
    preferences.set(cube=False)
    preferences.finish()
    assert Preferences(tmp_path).settings == Settings(legend=True)


def test_edits_in_a_row_are_written_once_and_elsewhere(qtbot, tmp_path, monkeypatch):
    threads = []
    write = preferences_module.write_atomically

    def watched(path, content):
        threads.append(threading.current_thread())
        write(path, content)

    monkeypatch.setattr(preferences_module, "write_atomically", watched)
    preferences = Preferences(tmp_path)
    for mean in (120.0, 130.0, 140.0):
        preferences.note_volume("a", tf=make_tf(mean))
    preferences.note_volume("b", tf=make_tf(150.0))
    qtbot.waitUntil(lambda: len(threads) == 2)
    preferences.finish()
    assert len(threads) == 2 and threading.current_thread() not in threads
    assert volume_file(tmp_path, "a").values.tf == make_tf(140.0)
    assert volume_file(tmp_path, "b").values.tf == make_tf(150.0)


def test_a_disk_that_fails_is_told_once(qtbot, tmp_path):
    (tmp_path / "file").write_text("")
    preferences = Preferences(tmp_path / "file" / "folder")
    told = []
    preferences.problem.connect(told.append)
    preferences.note_volume("a", tf=make_tf(120.0))
    qtbot.waitUntil(lambda: bool(told))
    preferences.note_volume("b", tf=make_tf(130.0))
    preferences.finish()
    (text,) = told
    assert "cannot be written" in text and str(tmp_path / "file") in text
    assert preferences.volume("b").tf == make_tf(130.0)


def test_recent_files_are_the_newest_ones_each_once(tmp_path):
    preferences = Preferences()
    files = [tmp_path / "data" / f"{n}.json" for n in range(MOST_RECENT + 2)]
    for path in [*files, files[5]]:
        preferences.note_recent("transfer_functions", path)
    expected = [files[5], *(p for p in reversed(files) if p != files[5])][:MOST_RECENT]
    assert preferences.recent("transfer_functions") == expected
    # Nothing is saved next to a sample unless that is chosen.
    preferences.note_recent("volumes", SCAN)
    assert preferences.settings.last_folder == str(tmp_path / "data")
    preferences.set(recent_transfer_functions=())
    assert preferences.recent("transfer_functions") == []


_edits = st.lists(
    st.tuples(
        st.sampled_from("ab"),
        st.one_of(
            st.tuples(st.just("recent"), st.sampled_from("vwxyz")),
            st.tuples(st.just("set"), st.sampled_from(["legend", "cube", "swapped"])),
            st.tuples(st.just("volume"), st.sampled_from(["f", "g"])),
            st.tuples(st.just("write"), st.none()),
            st.tuples(st.just("refresh"), st.sampled_from(["f", "g"])),
        ),
    ),
    max_size=12,
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(_edits)
def test_nothing_that_either_of_two_windows_has_added_is_lost(tmp_path_factory, edits):
    folder = tmp_path_factory.mktemp("windows")
    windows = {name: Preferences(folder) for name in "ab"}
    files, flags, views = set(), set(), {"f": set(), "g": set()}
    for number, (name, (kind, what)) in enumerate(edits):
        window = windows[name]
        match kind:
            case "recent":
                window.note_recent("volumes", Path("/data") / what)
                files.add(Path("/data") / what)
            case "set":
                window.set(**{what: not getattr(Settings(), what)})
                flags.add(what)
            case "volume":
                window.note_volume(what, view=View(number))
                views[what].add(View(number))
            case "write":
                window.finish()
            case "refresh":
                window.refresh(what)
    for window in windows.values():
        window.finish()
        # All is in the file already.
        assert not window._settings.unwritten()
    found = settings_file(folder).values
    assert {Path(text) for text in found.recent_volumes} == files
    assert {n for n in ("legend", "cube", "swapped") if getattr(found, n) != getattr(
        Settings(), n)} == flags  # fmt: skip
    for fingerprint, any_of in views.items():
        assert volume_file(folder, fingerprint).values.view in (any_of or {None})


def test_a_window_sees_what_another_has_made(tmp_path):
    first, second = Preferences(tmp_path), Preferences(tmp_path)
    first.set(legend=True)
    first.note_volume("f", up_axis="+y")
    second.note_volume("f", regions=(region("ribs"),))
    second.finish()
    assert first.refresh("f") == ""
    expected = VolumeMemory(regions=(region("ribs"),), up_axis="+y")
    assert first.volume("f") == expected
    first.finish()
    assert volume_file(tmp_path, "f").values == expected
    second.refresh("f")
    assert second.settings.legend and second.volume("f") == expected
