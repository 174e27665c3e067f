"""JSON from untrusted files: read within bounds, checked against a schema."""

import json
import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import msgspec

from model.errors import TfscopeError

MOST_BYTES = 64 << 20  # of the longest file that is read; tfscope's have a hundredth

T = TypeVar("T")


class MalformedError(ValueError):
    """Data is not JSON, or does not fit its type; the message says where."""


def read_json(path: Path) -> Any:
    """Read a JSON file as plain data; raise `OSError`, or `MalformedError` for invalid JSON."""
    # Not by its size on disk: a pipe or a device has none.
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise MalformedError(f"it is longer than {MOST_BYTES >> 20} MB")
    return parse_json(content)


def parse_json(content: bytes) -> Any:
    """Parse JSON as plain data; raise :class:`MalformedError` if it is invalid."""
    # Python's own parser: it also reads names of files that are not valid UTF-8, as it writes them.
    try:
        return json.loads(content.decode("utf-8-sig"))
    except RecursionError:
        raise MalformedError("its brackets are nested too deeply") from None
    except UnicodeDecodeError:
        raise MalformedError("it is not UTF-8 text") from None
    except ValueError as error:
        raise MalformedError(str(error)) from None


def build(kind: type[T], data: Any, exact: bool = False) -> T:
    """Build a dataclass from plain data; check names and types of its fields.

    Errors of the dataclass's own checks pass through. Raises :class:`MalformedError` for a missing
    field or wrong type, and if `exact` for an unknown name.
    """
    if exact and isinstance(data, dict):
        unknown = data.keys() - {field.name for field in fields(kind)}  # type: ignore[arg-type]
        if unknown:
            raise MalformedError(f"'{min(map(str, unknown))}', which is not known")
    try:
        return msgspec.convert(data, kind, dec_hook=_path)
    except RecursionError:
        raise MalformedError("its brackets are nested too deeply") from None
    except msgspec.ValidationError as error:
        raise MalformedError(_worded(str(error))) from error
    except UnicodeEncodeError:
        raise MalformedError("a text that is not valid Unicode") from None


def build_valid(kind: type[T], data: dict[str, Any]) -> tuple[T, list[str]]:
    """Build a dataclass whose fields have defaults, and list the fields with wrong values.

    These get their defaults. Of a tuple of any length, only wrong elements are dropped; a field
    that is a dataclass is built in the same way.
    """
    found: dict[str, Any] = {}
    wrong: list[str] = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        if name not in data:
            continue
        if is_dataclass(hint) and isinstance(hint, type) and isinstance(data[name], dict):
            found[name], wrong_inside = build_valid(hint, data[name])
            wrong += wrong_inside
            continue
        values = _valid(hint, data[name])
        if values:
            found[name] = values[0]
            continue
        wrong.append(name)
        if get_origin(hint) is tuple and get_args(hint)[-1] is ... and type(data[name]) is list:
            found[name] = tuple(v for each in data[name] for v in _valid(get_args(hint)[0], each))
    return kind(**found), wrong


def _valid(hint: Any, value: Any) -> list[Any]:
    """Return a value as another type in a list, or an empty list if it is none."""
    try:
        # Infinite and undefined numbers are of no use.
        json.dumps(value, allow_nan=False)
        return [build(hint, value)]
    except (ValueError, OverflowError, TfscopeError):
        return []


def _path(kind: type, value: Any) -> Any:
    if kind is Path and isinstance(value, str):
        return Path(value)
    raise TypeError(f"Expected {kind.__name__}, got {value!r}"[:200])


def _worded(text: str) -> str:
    """Word an error of msgspec like the others: first where, then what."""
    what, _, where = text.partition(" - at ")
    place = where.strip("`").removeprefix("$").removeprefix(".")
    missing = re.fullmatch(r"Object missing required field `(.*)`", what)
    if missing:
        place, what = ".".join(filter(None, (place, missing[1]))), "it is missing"
    what = what.replace("`", "")
    return f"'{place}' ({what})" if place else what
