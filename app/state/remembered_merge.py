"""Merging of what two windows remember, so that neither loses what is the other's."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from app.state.kept_fields import Merging, merging_of
from app.state.known_volume import KnownVolume
from app.state.remembered import MOST_VOLUMES, Remembered


def merged(base: Remembered, mine: Remembered, theirs: Remembered) -> Remembered:
    """Return what is in the file with what this window has changed.

    Where both have changed the same value, it is this window's, which is written later; of
    lists, both windows' additions and removals hold.

    Parameters
    ----------
    base : Remembered
        What was in the file when this window read it last.
    mine : Remembered
        What this window remembers now.
    theirs : Remembered
        What is in the file now.
    """
    values = _merged_fields(Remembered, base, mine, theirs)
    values["volumes"] = _merged_volumes(base.volumes, mine.volumes, theirs.volumes)
    return Remembered(**values)


def _merged_fields(table: type, base: Any, mine: Any, theirs: Any) -> dict[str, Any]:
    return {
        name: _merged_value(
            merging_of(table, name), *(getattr(one, name) for one in (base, mine, theirs))
        )
        for name in (each.name for each in fields(table))
    }


def _merged_value(merging: Merging, base: Any, mine: Any, theirs: Any) -> Any:
    if mine == base:
        return theirs
    if theirs == base:
        return mine
    if merging == "newest_first":
        return _newest_first(base, mine, theirs)
    if merging == "collected":
        kept = tuple(one for one in theirs if one in mine or one not in base)
        return (*kept, *(one for one in mine if one not in base and one not in kept))
    if merging == "greatest":
        return max(mine, theirs)
    if merging == "named":
        return {**theirs, **{k: v for k, v in mine.items() if base.get(k) != v}}
    return mine


def _newest_first(
    base: tuple[str, ...], mine: tuple[str, ...], theirs: tuple[str, ...]
) -> tuple[str, ...]:
    """Put what this window has put first before what the other one has there."""
    first = _put_first(base, mine)
    removed = {one for one in base if one not in mine} if not mine else set()
    return (*first, *(one for one in theirs if one not in first and one not in removed))


def _put_first(before: tuple[str, ...], after: tuple[str, ...]) -> tuple[str, ...]:
    """Return what has come to the head of a list."""
    return after[: next(n for n in range(len(after) + 1) if _follows(after[n:], before))]


def _follows(part: tuple[str, ...], whole: tuple[str, ...]) -> bool:
    """Whether a list is another one without some of its texts."""
    rest = iter(whole)
    return all(one in rest for one in part)


def _merged_volumes(
    base: dict[str, KnownVolume], mine: dict[str, KnownVolume], theirs: dict[str, KnownVolume]
) -> dict[str, KnownVolume]:
    """Merge volume by volume; those of which this window knows news are the newest."""
    found, news = dict(theirs), {}
    touched = _put_first(tuple(reversed(base)), tuple(reversed(mine)))
    for fingerprint, known in mine.items():
        before = base.get(fingerprint, KnownVolume())
        if known != before or fingerprint in touched:
            there = found.pop(fingerprint, before)
            news[fingerprint] = KnownVolume(**_merged_fields(KnownVolume, before, known, there))
    return dict([*found.items(), *news.items()][-MOST_VOLUMES:])
