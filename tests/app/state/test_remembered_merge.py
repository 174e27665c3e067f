from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.state.known_volume import KnownRegion, KnownVolume
from app.state.preferences import Preferences, PreferencesStore
from app.state.remembered import Remembered
from app.state.remembered_merge import merged

CORNERS = ((0.1, 0.1), (0.2, 0.1), (0.2, 0.2))


def region(name: str) -> KnownRegion:
    return KnownRegion(name, CORNERS)


def test_regions_of_both_are_there_and_what_was_removed_is_not() -> None:
    base = Remembered(volumes={"f": KnownVolume(regions=(region("1"), region("2")))})
    mine = replace(base, volumes={"f": KnownVolume(regions=(region("ribs"), region("2")))})
    others = (region("1"), region("3"))
    theirs = replace(base, volumes={"f": KnownVolume(regions=others, up_axis="-y")})
    found = merged(base, mine, theirs).volumes["f"]
    assert found.regions == (region("3"), region("ribs"))
    assert found.up_axis == "-y"


_lists = st.lists(st.sampled_from("abcdef"), unique=True, max_size=5).map(tuple)


@given(_lists, _lists, _lists)
def test_nothing_that_either_has_added_is_lost(
    base: tuple[str, ...], mine: tuple[str, ...], theirs: tuple[str, ...]
) -> None:
    def remembered(names: tuple[str, ...]) -> Remembered:
        regions = tuple(map(region, names))
        return Remembered(recent_models=names, volumes={"f": KnownVolume(regions=regions)})

    found = merged(*map(remembered, (base, mine, theirs)))
    added = (set(mine) | set(theirs)) - set(base)
    assert added <= {one.name for one in found.volumes["f"].regions}
    assert set(found.recent_models) >= set(theirs) - set(base)
    assert len(set(found.recent_models)) == len(found.recent_models)
    assert merged(*map(remembered, (base, mine, base))) == remembered(mine)
    assert merged(*map(remembered, (base, base, theirs))) == remembered(theirs)


def test_two_windows_at_once_overwrite_nothing_of_each_other(tmp_path: Path) -> None:
    store = PreferencesStore(tmp_path / "preferences.json")
    windows = {name: Preferences(store) for name in "ab"}
    for number in range(10):
        for name, preferences in windows.items():
            preferences.note_volume(f"{name}{number}", Path(f"/{name}{number}.nrrd"))
            known = preferences.volume("both").regions
            preferences.note_volume("both", regions=(*known, region(f"{name}{number}")))
        for preferences in windows.values():
            preferences.finish()
    found = store.load()
    names = {f"{name}{number}" for name in "ab" for number in range(10)}
    assert set(found.volumes) == {*names, "both"}
    assert {one.name for one in found.volumes["both"].regions} == names


@pytest.mark.parametrize("early", [True, False])
def test_a_window_sees_what_another_has_named(tmp_path: Path, early: bool) -> None:
    store = PreferencesStore(tmp_path / "preferences.json")
    first = Preferences(store)
    first.set(legend=True)
    if early:
        first.finish()
    second = Preferences(store)
    second.note_volume("f", regions=(region("ribs"),))
    second.finish()
    heard: list[frozenset[str]] = []
    first.changed.connect(heard.append)
    first.refresh()
    assert heard == [frozenset({"volumes"})]
    assert first.volume("f").regions == (region("ribs"),)
    first.note_volume("f", up_axis="+y")
    first.finish()
    found = store.load()
    assert found.legend and found.volumes["f"].regions == (region("ribs"),)
    assert found.volumes["f"].up_axis == "+y"
