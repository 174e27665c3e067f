"""What the window remembers between runs: kept in a file, and told to whoever listens."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import chain, count
from pathlib import Path
from typing import Any, Literal

from filelock import FileLock, Timeout
from PySide6.QtCore import QObject, Signal

from app.state.delayed_writer import DelayedWriter
from app.state.known_volume import KnownVolume, changed_volume
from app.state.remembered import MOST_VOLUMES, Remembered
from app.state.remembered_merge import merged
from app.state.user_folder import user_folder
from model.errors import TfscopeError, reason
from model.files import write_atomically
from model.json_files import read_json

LOCK_PATIENCE_S = 5.0
"""Time after which the file is written without a lock: who holds it that long hangs."""

RecentKind = Literal["volumes", "models", "transfer_functions", "sessions"]


class PreferencesError(TfscopeError):
    """The file of what is remembered cannot be read or written."""


def _unwritten(path: Path, error: OSError) -> str:
    return (
        f"{path}: the window's settings cannot be written ({reason(error)}); "
        "they are not kept for the next start."
    )


class PreferencesStore:
    """The file of what is remembered.

    Parameters
    ----------
    path : Path
        A JSON file; its folder is made by the first save.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @classmethod
    def of_user(cls) -> PreferencesStore:
        """Return the store in the user's application data folder."""
        return cls(user_folder() / "preferences.json")

    def load(self) -> Remembered:
        """Read the file; return defaults if there is none.

        Raises
        ------
        PreferencesError
            When the file is damaged or another program's, and has been renamed. A file
            that cannot be read or renamed stays in place.
        """
        if not self.path.exists():
            return Remembered()
        try:
            return Remembered.from_json(read_json(self.path))
        except OSError as error:
            raise PreferencesError(
                f"{self.path}: the window's settings cannot be read ({reason(error)}), so it "
                "starts with the usual ones and keeps none; check your permissions."
            ) from error
        except ValueError as error:
            raise PreferencesError(
                f"{self.path}: the window's settings are damaged ({error}), so it starts with the "
                f"usual ones; {self._set_aside()}."
            ) from error

    def update(self, base: Remembered, mine: Remembered) -> Remembered:
        """Write what was changed into the file, and return all that is in it then.

        What other windows have written meanwhile stays; see :func:`merged`.

        Parameters
        ----------
        base : Remembered
            What was in the file when it was read last.
        mine : Remembered
            What shall be in it, as far as that differs.

        Raises
        ------
        PreferencesError
            When it cannot be written.
        """
        with self._locked():
            try:
                theirs = self.load() if self.path.exists() else base
            except PreferencesError as error:
                if isinstance(error.__cause__, OSError):
                    raise PreferencesError(_unwritten(self.path, error.__cause__)) from error
                # What is damaged has nothing to be kept, and was set aside.
                theirs = base
            result = merged(base, mine, theirs)
            self.save(result)
        return result

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Keep other windows from writing; where there are no locks, it is a little less sure."""
        lock = None
        with suppress(OSError, NotImplementedError, Timeout):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            lock = FileLock(self.path.with_suffix(".lock"), timeout=LOCK_PATIENCE_S)
            lock.acquire()
        try:
            yield
        finally:
            if lock is not None:
                lock.release()

    def save(self, remembered: Remembered) -> None:
        """Write the file, whole or not at all.

        Raises
        ------
        PreferencesError
            When it cannot be written.
        """
        content = json.dumps(remembered.to_json(), indent=1).encode()
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(self.path, content)
        except OSError as error:
            raise PreferencesError(_unwritten(self.path, error)) from error

    def _set_aside(self) -> str:
        """Rename the file, and say what has become of it."""
        first = self.path.with_suffix(".damaged")
        names = chain([first], (first.with_suffix(f".{i}.damaged") for i in count(2)))
        aside = next(name for name in names if not name.exists())
        with suppress(OSError):
            self.path.replace(aside)
            return f"the file is kept as {aside.name}"
        return "it could not be renamed, so nothing is kept for the next start"


class Preferences(QObject):
    """Remembers choices, files and volumes between runs.

    What is changed is written shortly afterwards, in a thread of its own, and by :meth:`finish`.
    Other windows may write into the same file; what they remember comes with :meth:`refresh`.

    Parameters
    ----------
    store : PreferencesStore or None
        None keeps everything in memory.

    Attributes
    ----------
    start_problem : str
        A sentence for the user if the file could not be read at the start; mostly empty.
    """

    changed = Signal(object)
    """Emitted with the set of the changed values' names."""
    problem = Signal(str)
    """Emitted with a sentence when the file cannot be written."""

    def __init__(
        self, store: PreferencesStore | None = None, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._store = store
        self._values = Remembered()
        self._base = self._values
        """Content of the file when it was read or written last."""
        self._written: tuple[Remembered, Remembered] | None = None
        """What the last write was given, and what is in the file since."""
        self._writer = DelayedWriter(self._take, "preferences", self)
        self._writer.problem.connect(self.problem)
        self.start_problem = ""
        if store is not None:
            try:
                self._values = self._base = store.load()
            except PreferencesError as error:
                self.start_problem = str(error)
                if store.path.exists():
                    # It could not even be set aside, and must not be overwritten.
                    self._store = None

    @property
    def folder(self) -> Path | None:
        """Folder of the file; None where everything is in memory only."""
        return None if self._store is None else self._store.path.parent

    @property
    def values(self) -> Remembered:
        """Everything that is remembered now."""
        return self._values

    def value(self, name: str) -> Any:
        """Return one value, by its name in :class:`Remembered`."""
        return getattr(self._values, name)

    def set(self, **changes: Any) -> None:
        """Change some values, by their names in :class:`Remembered`.

        Raises
        ------
        ValueError
            For a name that there is not, or a value outside its range.
        """
        before = self._values
        after = before.with_changes(changes)
        names = {n for n in changes if getattr(before, n) != getattr(after, n)}
        if not names and list(before.volumes) == list(after.volumes):
            return
        self._values = after
        if self._store is not None:
            self._writer.note()
        if names:
            self.changed.emit(frozenset(names))

    def refresh(self) -> None:
        """Take in what other windows have written since."""
        if self._store is None or not self._store.path.exists():
            return
        self._absorb()
        try:
            theirs = Remembered.from_json(read_json(self._store.path))
        except (OSError, ValueError):
            # The next write says so.
            return
        before, self._values = self._values, merged(self._base, self._values, theirs)
        self._base = theirs
        after = self._values
        names = {n for n in vars(before) if getattr(before, n) != getattr(after, n)}
        if names:
            self.changed.emit(frozenset(names))

    def volume(self, fingerprint: str) -> KnownVolume:
        """Return what is remembered of a volume; all empty if it is new."""
        return self._values.volumes.get(fingerprint, KnownVolume())

    def note_volume(self, fingerprint: str, path: Path | None = None, **known: Any) -> None:
        """Remember something of a volume, which becomes the newest.

        Parameters
        ----------
        path : Path or None
            Where it was opened; it becomes the first of the recent volumes. None changes
            neither.
        **known
            Further values, by their names in :class:`KnownVolume`.

        Raises
        ------
        ValueError
            For a name that there is not, or a wrong value.
        """
        if path is not None:
            known["path"] = str(path.absolute())
        volumes = {k: v for k, v in self._values.volumes.items() if k != fingerprint}
        volumes[fingerprint] = changed_volume(self.volume(fingerprint), known)
        newest = dict(list(volumes.items())[-MOST_VOLUMES:])
        self.set(volumes=newest, **({} if path is None else self._recent("volumes", path)))

    def note_model(self, folder: Path, fingerprint: str) -> None:
        """Remember that a model was opened with a volume; it becomes the first of both lists."""
        models = _first(str(folder.absolute()), self.volume(fingerprint).models)
        self.note_volume(fingerprint, models=models)
        self.set(**self._recent("models", folder))

    def note_transfer_function(self, path: Path) -> None:
        """Remember that a TF file was opened or saved; it becomes the first of the recent ones."""
        self.set(**self._recent("transfer_functions", path))

    def note_session(self, path: Path) -> None:
        """Remember that a session was opened or saved; it becomes the first of the recent ones."""
        self.set(**self._recent("sessions", path))

    def recent(self, kind: RecentKind) -> list[Path]:
        """Return the recent files of a kind, the newest first, whether they exist or not."""
        return [Path(text) for text in self.value(f"recent_{kind}")]

    def forget_recent(self, kind: RecentKind) -> None:
        """Empty the list of the recent files of a kind."""
        self.set(**{f"recent_{kind}": ()})

    def finish(self) -> None:
        """Write what is not written yet, and wait for it."""
        self._writer.finish()

    def _recent(self, kind: RecentKind, path: Path) -> dict[str, Any]:
        """Return the changes that put a file first among the recent ones.

        Dialogs open where the last file was. A model is found with its volume, without anybody
        having been in its folder.
        """
        name, place = f"recent_{kind}", path.absolute()
        changes: dict[str, Any] = {name: _first(str(place), self.value(name))}
        return changes if kind == "models" else changes | {"last_folder": str(place.parent)}

    def _take(self) -> Callable[[], None]:
        self._absorb()
        return partial(self._update, self._base, self._values)

    def _update(self, base: Remembered, mine: Remembered) -> None:
        assert self._store is not None
        self._written = mine, self._store.update(base, mine)

    def _absorb(self) -> None:
        """Go on from what the last write has put into the file."""
        if self._written is not None:
            (mine, written), self._written = self._written, None
            self._values = merged(mine, self._values, written)
            self._base = written


def _first(text: str, others: tuple[str, ...]) -> tuple[str, ...]:
    """Put a text first; a longer list is cut where it is taken."""
    return (text, *(other for other in others if other != text))
