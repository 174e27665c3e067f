"""Fields of what is kept in files: each is declared once, with all that is done with it.

A dataclass of such fields is its own table: how values from a file are checked, which of them
belong to a session, and how the values of two windows become one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, Literal

from app.state.value_checks import Check, Checks

Merging = Literal["newest", "newest_first", "collected", "greatest", "named"]
"""Ways in which two windows' changes of a value become one: the later one counts; a list in which
whatever was opened last stands first; a list to which something is added, and from which something
is removed; a number that grows; a dict whose values are merged by name."""

_KEY = "kept"


@dataclass(frozen=True)
class _Kept:
    check: Check | None
    in_session: bool
    merging: Merging


def kept(check: Check, default: Any, in_session: bool = False, merging: Merging = "newest") -> Any:
    """Return a field of a dataclass whose values are kept in files.

    Parameters
    ----------
    check : callable
        Takes a value from a file and returns it as it is to be used, or raises ValueError.
    default : object
        The value where there is none; a type, such as dict, is called for it.
    in_session : bool
        Whether a session's file holds it.
    merging : str
        See :data:`Merging`.
    """
    metadata = {_KEY: _Kept(check, in_session, merging)}
    if isinstance(default, type):
        return field(default_factory=default, metadata=metadata)
    return field(default=default, metadata=metadata)


def unknown() -> Any:
    """Return the field for what this version does not know, a dict that is to be kept."""
    metadata = {_KEY: _Kept(None, in_session=False, merging="named")}
    return field(default_factory=dict, metadata=metadata)


def checks_of(table: type, in_session: bool = False) -> Checks:
    """Return the checks of a dataclass's kept fields by name; of all, or those in a session."""
    return {
        name: each.check
        for name, each in _kept_fields(table).items()
        if each.check is not None and (each.in_session or not in_session)
    }


def merging_of(table: type, name: str) -> Merging:
    """Return how two windows' values of a field become one."""
    return _kept_fields(table)[name].merging


def _kept_fields(table: type) -> dict[str, _Kept]:
    return {each.name: each.metadata[_KEY] for each in fields(table) if _KEY in each.metadata}
