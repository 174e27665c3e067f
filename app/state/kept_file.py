"""A file of values that several windows keep between runs."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Generic, TypeVar

from filelock import FileLock, Timeout

from model.errors import TfscopeError, reason
from model.files import write_atomically
from model.json_files import MalformedError, build_valid, read_json

LOCK_PATIENCE_S = 5.0
"""Time after which the file is written without a lock: a window that holds it longer hangs."""

T = TypeVar("T")
Change = Callable[[T], T]


class KeptFileError(TfscopeError):
    """A file of kept values cannot be written."""


class KeptFile(Generic[T]):
    """Values of a dataclass in a JSON file, or without a path in memory only.

    A change is made here at once, and made again on what is in the file when it is written. So
    windows overwrite nothing of each other but what both have changed: there the last one wins.

    If the file could not be read, `problem` is a sentence for the user.
    """

    def __init__(self, path: Path | None, kind: type[T]) -> None:
        self._path, self._kind = path, kind
        self._mark = f"tfscope_{kind.__name__.lower()}"
        self._changes: list[Change[T]] = []
        self._written = 0
        self.values = kind()
        self.problem = ""
        self.refresh()

    def change(self, change: Change[T]) -> None:
        """Change the values by a function, which may be called more than once."""
        self.values = change(self.values)
        if self._path is not None:
            self._changes.append(change)

    def refresh(self) -> None:
        """Take in what other windows have written since."""
        if self._path is None:
            return
        self._forget_written()
        values, self.problem = self.values, ""
        try:
            values = self._build(self._read(self._path), self._path)
        except OSError as error:
            self.problem = (
                f"{self._path}: the file cannot be read ({reason(error)}), so nothing is kept "
                "in it; check your permissions."
            )
            # It must not be overwritten.
            self._path = None
        except MalformedError as error:
            self.problem = f"{self._path}: the file is damaged ({error}); {_set_aside(self._path)}."
        for change in self._changes:
            values = change(values)
        self.values = values

    def reread(self) -> KeptFile[T]:
        """Return the file read anew, with the changes that are not written yet; from any thread."""
        if self._path is None:
            return self
        file = KeptFile(self._path, self._kind)
        for change in tuple(self._changes):
            file.change(change)
        return file

    def unwritten(self) -> Callable[[], None] | None:
        """Return a function that writes what is not written yet, from any thread; None if all is.

        It raises :class:`KeptFileError` where the file cannot be written.
        """
        self._forget_written()
        if self._path is None or not self._changes:
            return None
        return partial(self._write, self._path, self.values, tuple(self._changes))

    def _forget_written(self) -> None:
        del self._changes[: self._written]
        self._written = 0

    def _write(self, path: Path, mine: T, changes: tuple[Change[T], ...]) -> None:
        try:
            with _locked(path):
                data: dict[str, Any] = {}
                with suppress(MalformedError):
                    data = self._read(path)
                    mine, _wrong = build_valid(self._kind, data)
                    for change in changes:
                        mine = change(mine)
                # What a newer version has written stays.
                content = {self._mark: 1, **data, **asdict(mine)}  # type: ignore[call-overload]
                write_atomically(path, json.dumps(content, indent=1).encode())
        except OSError as error:
            raise KeptFileError(
                f"{path}: the file cannot be written ({reason(error)}); what you change is not "
                "kept for the next start."
            ) from error
        self._written = len(changes)

    def _read(self, path: Path) -> dict[str, Any]:
        if not path.exists():
            return {}
        data = read_json(path)
        if not isinstance(data, dict) or self._mark not in data:
            raise MalformedError(f"the key '{self._mark}' is missing")
        return data

    def _build(self, data: dict[str, Any], path: Path) -> T:
        values, wrong = build_valid(self._kind, data)
        # An earlier version may have kept what is no choice any more.
        if wrong and path.exists():
            names = ", ".join(f"'{name}'" for name in wrong)
            self.problem = f"{path}: its {names} could not be read; the rest is there."
        return values


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Keep other windows from writing; where there are no locks, it is a little less sure."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = FileLock(path.parent / "lock", timeout=LOCK_PATIENCE_S)
    with suppress(OSError, NotImplementedError, Timeout):
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def _set_aside(path: Path) -> str:
    """Rename a file, and say what has become of it."""
    names = (path.with_suffix(f"{'' if i == 1 else f'.{i}'}.damaged") for i in count(1))
    aside = next(name for name in names if not name.exists())
    with suppress(OSError):
        path.replace(aside)
        return f"it is kept as {aside.name}"
    return "it is overwritten by the next change"
