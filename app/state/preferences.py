"""Memory of the window between runs: settings, and a memory of each volume."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QStandardPaths, Signal

from app.engines.background import LatestCall, Pause
from app.engines.messages import error_sentence
from app.state.kept_file import KeptFile
from app.state.settings import RecentKind, Settings, VolumeMemory

PAUSE_MS = 300
"""Time after the first of some changes in a row before they are written."""

MOST_RECENT = 10
"""Number of recent files of each kind, and of remembered models of a volume."""

MOST_PLACES = 300
"""Number of paths of volumes that are remembered."""


def user_folder() -> Path:
    """Return the folder for what is kept between runs; it may not exist yet."""
    return Path(QStandardPaths.writableLocation(QStandardPaths.StandardLocation.AppDataLocation))


def settings_file(folder: Path | None) -> KeptFile[Settings]:
    """Return the file of settings in a user's folder; None keeps them in memory."""
    return KeptFile(None if folder is None else folder / "settings.json", Settings)


def volume_file(folder: Path | None, fingerprint: str) -> KeptFile[VolumeMemory]:
    """Return the file of a volume's memory in a user's folder; None keeps it in memory."""
    if folder is None:
        return KeptFile(None, VolumeMemory)
    # Cards of models say fingerprints, too: theirs may be any text.
    name = "".join(filter(str.isalnum, fingerprint))[:32]
    return KeptFile(folder / "volumes" / f"{name}.json", VolumeMemory)


class Preferences(QObject):
    """Remembers settings, recent files and volumes, in a folder or in memory only.

    What is changed is written shortly afterwards, in a thread of its own, and by :meth:`finish`.
    After a failed write nothing more is written. If the settings could not be read at the start,
    `start_problem` is a sentence for the user.
    """

    problem = Signal(str)
    """Emitted with a sentence when a file cannot be written."""

    def __init__(self, folder: Path | None = None, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.folder = folder
        self._settings = settings_file(folder)
        self.start_problem = self._settings.problem
        self._volumes: dict[str, KeptFile[VolumeMemory]] = {}
        self._has_failed = False
        self._pause = Pause(self, PAUSE_MS, self._write)
        self._writing = LatestCall("preferences", self, lambda _done: None, self._fail)

    @property
    def settings(self) -> Settings:
        """The present settings."""
        return self._settings.values

    def set(self, **changes: Any) -> None:
        """Change some settings, by their names in :class:`Settings`."""
        self._change_settings(partial(replace, **changes))

    def volume(self, fingerprint: str) -> VolumeMemory:
        """Return what is remembered of a volume."""
        return self._volume(fingerprint).values

    def volume_at(self, path: Path) -> VolumeMemory:
        """Return what is remembered of the volume that was opened at a path last."""
        fingerprint = self.settings.places.get(str(path.absolute()))
        return VolumeMemory() if fingerprint is None else self.volume(fingerprint)

    def recall(self, fingerprint: str) -> tuple[VolumeMemory, str]:
        """Read what is kept of a volume, and what is wrong with its file; from any thread."""
        known = self._volumes.get(fingerprint)
        file = volume_file(self.folder, fingerprint) if known is None else known.reread()
        return file.values, file.problem

    def refresh(self, fingerprint: str) -> str:
        """Take in what other windows have written of a volume, and their settings.

        Return a sentence for the user if the volume's file could not be read; mostly empty.
        """
        file = self._volume(fingerprint)
        problem = file.problem
        self._settings.refresh()
        file.refresh()
        return problem or file.problem

    def note_volume(self, fingerprint: str, **changes: Any) -> None:
        """Remember something of a volume, by its names in :class:`VolumeMemory`."""
        file = self._volume(fingerprint)
        if any(getattr(file.values, name) != value for name, value in changes.items()):
            file.change(partial(replace, **changes))
            self._write_soon()

    def note_opened(self, fingerprint: str, path: Path) -> None:
        """Remember where a volume was opened; it becomes the first of the recent ones."""
        place = str(path.absolute())
        self.note_volume(fingerprint, path=place)
        self._change_settings(partial(_with_place, place=place, fingerprint=fingerprint))
        self.note_recent("volumes", path)

    def note_model(self, folder: Path, fingerprint: str) -> None:
        """Remember that a model was opened with a volume; it becomes the first of both lists."""
        models = _first(str(folder.absolute()), self.volume(fingerprint).models)
        self.note_volume(fingerprint, models=models)
        self.note_recent("models", folder)

    def note_recent(self, kind: RecentKind, path: Path) -> None:
        """Put a file first among the recent ones of its kind."""
        self._change_settings(partial(_with_recent, kind=kind, path=path.absolute()))

    def recent(self, kind: RecentKind) -> list[Path]:
        """Return the recent files of a kind, the newest first, whether they exist or not."""
        return [Path(text) for text in getattr(self.settings, f"recent_{kind}")[:MOST_RECENT]]

    def forget_recent(self, kind: RecentKind) -> None:
        """Empty the list of the recent files of a kind."""
        self.set(**{f"recent_{kind}": ()})

    def finish(self) -> None:
        """Write what is not written yet, and wait for it."""
        self._pause.stop()
        self._writing.join()
        if not self._has_failed:
            try:
                self._unwritten()()
            except Exception as error:
                self._fail(error_sentence(error))

    def _change_settings(self, change: Callable[[Settings], Settings]) -> None:
        if change(self.settings) != self.settings:
            self._settings.change(change)
            self._write_soon()

    def _write_soon(self) -> None:
        # Not anew at every change: a long drag would then be written at its end only.
        if not (self.folder is None or self._has_failed or self._pause.isActive()):
            self._pause.start()

    def _write(self) -> None:
        if self._writing.is_running:
            # One at a time, so that an older state never replaces a newer one.
            self._pause.start()
        else:
            self._writing.ask(self._unwritten())

    def _fail(self, text: str) -> None:
        # Once: the same disk may fail for a thread and for the end of it all.
        if not self._has_failed:
            self._has_failed = True
            self._pause.stop()
            self.problem.emit(text)

    def _volume(self, fingerprint: str) -> KeptFile[VolumeMemory]:
        if fingerprint not in self._volumes:
            self._volumes[fingerprint] = volume_file(self.folder, fingerprint)
        return self._volumes[fingerprint]

    def _unwritten(self) -> Callable[[], None]:
        writes = [self._settings.unwritten()]
        writes += [file.unwritten() for file in self._volumes.values()]
        return partial(_call_all, list(filter(None, writes)))


def _call_all(functions: list[Callable[[], None]]) -> None:
    for function in functions:
        function()


def _first(text: str, others: tuple[str, ...]) -> tuple[str, ...]:
    return (text, *(other for other in others if other != text))[:MOST_RECENT]


def _with_recent(settings: Settings, kind: RecentKind, path: Path) -> Settings:
    """Put a file first among the recent ones.

    Dialogs open where the last file was. A model is found with its volume: the user
    need not have been in its folder.
    """
    name = f"recent_{kind}"
    changes: dict[str, Any] = {name: _first(str(path), getattr(settings, name))}
    if kind != "models":
        changes["last_folder"] = str(path.parent)
    return replace(settings, **changes)


def _with_place(settings: Settings, place: str, fingerprint: str) -> Settings:
    others = {p: f for p, f in settings.places.items() if p != place}
    newest = [*others.items(), (place, fingerprint)][-MOST_PLACES:]
    return replace(settings, places=dict(newest))
