"""What the window remembers between runs: kept in a file, and told to whoever listens."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from itertools import chain, count
from pathlib import Path
from typing import Any, Literal

from PySide6.QtCore import QObject, QStandardPaths, Signal

from app.state.delayed_writer import DelayedWriter
from app.state.remembered import MOST_VOLUMES, KnownVolume, Remembered, changed_volume
from model.errors import TfscopeError, reason
from model.files import write_atomically
from model.json_files import read_json

RecentKind = Literal["volumes", "models", "transfer_functions"]


class PreferencesError(TfscopeError):
    """The file of what is remembered cannot be read or written."""


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
        place = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.AppDataLocation)
        return cls(Path(place) / "preferences.json")

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
            raise PreferencesError(
                f"{self.path}: the window's settings cannot be written ({reason(error)}); "
                "they are not kept for the next start."
            ) from error

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
        self._writer = DelayedWriter(self._take, "preferences", self)
        self._writer.problem.connect(self.problem)
        self.start_problem = ""
        if store is not None:
            try:
                self._values = store.load()
            except PreferencesError as error:
                self.start_problem = str(error)
                if store.path.exists():
                    # It could not even be set aside, and must not be overwritten.
                    self._store = None

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

    def volume(self, fingerprint: str) -> KnownVolume:
        """Return what is remembered of a volume; all empty if it is new."""
        return self._values.volumes.get(fingerprint, KnownVolume())

    def note_volume(self, fingerprint: str, path: Path | None = None, **known: Any) -> None:
        """Remember something of a volume, which becomes the newest.

        Parameters
        ----------
        fingerprint : str
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

    def recent(self, kind: RecentKind) -> list[Path]:
        """Return the recent files of a kind, the newest first, whether they exist or not."""
        return [Path(text) for text in self.value(f"recent_{kind}")]

    def existing(self, kind: RecentKind) -> list[Path]:
        """Return the recent files of a kind that exist, the newest first."""
        return [path for path in self.recent(kind) if path.exists()]

    def forget_recent(self, kind: RecentKind) -> None:
        """Empty the list of the recent files of a kind."""
        self.set(**{f"recent_{kind}": ()})

    def finish(self) -> None:
        """Write what is not written yet, and wait for it."""
        self._writer.finish()

    def _recent(self, kind: RecentKind, path: Path) -> dict[str, Any]:
        """Return the changes that put a file first among the recent ones."""
        name, place = f"recent_{kind}", path.absolute()
        return {name: _first(str(place), self.value(name)), "last_folder": str(place.parent)}

    def _take(self) -> Callable[[], None]:
        assert self._store is not None
        return partial(self._store.save, self._values)


def _first(text: str, others: tuple[str, ...]) -> tuple[str, ...]:
    """Put a text first; a longer list is cut where it is taken."""
    return (text, *(other for other in others if other != text))
