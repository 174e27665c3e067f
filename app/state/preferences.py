"""Memory of the window between runs: settings, and a memory of each volume, in files."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Generic, TypeVar

from filelock import FileLock, Timeout
from PySide6.QtCore import QObject, QStandardPaths, Signal

from app.engines.background import LatestCall, Pause
from app.engines.messages import error_sentence
from app.state.settings import RecentKind, Settings, VolumeMemory
from model.errors import TfscopeError, reason
from model.files import write_atomically
from model.json_files import MalformedError, build_valid, read_json
from model.scene.mask import Mask
from model.scene.volume import Volume
from model.volume_files.shipped import RESOURCES

LOCK_PATIENCE_S = 5.0  # after which a file is written without its lock: its holder hangs

T = TypeVar("T")
Change = Callable[[T], T]


class KeptFileError(TfscopeError):
    """A file of kept values cannot be written."""


class KeptFile(Generic[T]):
    """Values of a dataclass in a JSON file or, without a path, in memory.

    A change is made at once, and repeated on the file's content when that is written. So windows
    keep each other's changes; if both change one value, the last one wins.
    """

    def __init__(self, path: Path | None, kind: type[T]) -> None:
        self._path, self._kind = path, kind
        self._mark = f"tfscope_{kind.__name__.lower()}"
        self._changes: list[Change[T]] = []
        self._written = 0
        self.values = kind()
        self.problem = ""  # sentence for the user where the file could not be read
        self.refresh()

    def change(self, change: Change[T]) -> None:
        """Change the values by a function, which may be called again."""
        self.values = change(self.values)
        if self._path is not None:
            self._changes.append(change)

    def refresh(self) -> None:
        """Read other windows' changes."""
        path = self._path
        if path is None:
            return
        self._forget_written()
        values, self.problem = self.values, ""
        try:
            values, wrong = build_valid(self._kind, self._read(path))
            if wrong:
                # An earlier version may have written a value that is no longer a choice.
                names = ", ".join(f"'{name}'" for name in wrong)
                self.problem = f"{path}: its {names} could not be read; everything else was read."
        except OSError as error:
            self.problem = (
                f"{path}: the file cannot be read ({reason(error)}), so nothing is kept "
                "in it; check your permissions."
            )
            # It must not be overwritten.
            self._path = None
        except MalformedError as error:
            self.problem = f"{path}: the file is damaged ({error}); {_set_aside(path)}."
        for change in self._changes:
            values = change(values)
        self.values = values

    def reread(self) -> KeptFile[T]:
        """Return the file's content with the unwritten changes; from any thread."""
        if self._path is None:
            return self
        file = KeptFile(self._path, self._kind)
        for change in tuple(self._changes):
            file.change(change)
        return file

    def unwritten(self) -> Callable[[], None] | None:
        """Return a function that writes the changes, from any thread; None if there are none."""
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
                # Fields of newer versions stay.
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


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Lock the file against other windows, if the system has locks."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = FileLock(path.parent / "lock", timeout=LOCK_PATIENCE_S)
    with suppress(OSError, NotImplementedError, Timeout):
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def _set_aside(path: Path) -> str:
    """Rename a file, and return a sentence about it."""
    names = (path.with_suffix(f"{'' if i == 1 else f'.{i}'}.damaged") for i in count(1))
    aside = next(name for name in names if not name.exists())
    with suppress(OSError):
        path.replace(aside)
        return f"it is kept as {aside.name}"
    return "it is overwritten by the next change"


PAUSE_MS = 300  # delay from the first unwritten change to writing
MOST_RECENT = 10  # number of recent files of each kind, and of remembered models of a volume
MASK_END = ".mask.nrrd"  # of a mask's file
OLD_S = 30 * 24 * 3600  # seconds for which a mask is kept that another has replaced
MOST_PLACES = 300  # number of paths of volumes that are remembered


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
    return KeptFile(folder / "volumes" / f"{_name(fingerprint)}.json", VolumeMemory)


def _name(fingerprint: str) -> str:
    # Fingerprints from models' cards may be any text.
    return "".join(filter(str.isalnum, fingerprint))[:32]


class Preferences(QObject):
    """Remembers settings, recent files and volumes, in a folder or in memory only.

    Changes are written shortly afterwards, in a thread, and by :meth:`finish`. After a failed
    write, nothing more is written.
    """

    problem = Signal(str)  # emitted with a sentence when a file cannot be written

    def __init__(self, folder: Path | None = None, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.folder = folder
        self._settings = settings_file(folder)
        self.start_problem = self._settings.problem  # sentence for the user
        self._volumes: dict[str, KeptFile[VolumeMemory]] = {}
        # By fingerprint, with their file names; and functions that write the new ones.
        self._masks: dict[str, tuple[str, Mask]] = {}
        self._new_masks: dict[Path, Callable[[], None]] = {}
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
        """Return the memory of the volume that was last opened at a path."""
        fingerprint = self.settings.places.get(str(path.absolute()))
        return VolumeMemory() if fingerprint is None else self.volume(fingerprint)

    def recall(self, fingerprint: str) -> tuple[VolumeMemory, str]:
        """Read a volume's memory, and what is wrong with its file; from any thread."""
        known = self._volumes.get(fingerprint)
        file = volume_file(self.folder, fingerprint) if known is None else known.reread()
        return file.values, file.problem

    def refresh(self, fingerprint: str) -> str:
        """Read other windows' changes; return what is wrong with a volume's file."""
        file = self._volume(fingerprint)
        problem = file.problem
        self._settings.refresh()
        file.refresh()
        return problem or file.problem

    def note_volume(self, fingerprint: str, **changes: Any) -> None:
        """Change fields of a volume's :class:`VolumeMemory`."""
        file = self._volume(fingerprint)
        if any(getattr(file.values, name) != value for name, value in changes.items()):
            file.change(partial(replace, **changes))
            self._write_soon()

    def keep_mask(self, fingerprint: str, mask: Mask | None, volume: Volume) -> str:
        """Keep a volume's mask, to be written soon; return its name in the memory."""
        if mask is None:
            return ""
        known = self._masks.get(fingerprint)
        if known is not None and known[1] == mask:
            return known[0]
        # Named by its content: another window may have another mask of the same volume.
        content = hashlib.sha256(mask.bits + mask.edge).hexdigest()[:16]
        name = f"{_name(fingerprint)}.{content}{MASK_END}"
        self._masks[fingerprint] = name, mask
        if self.folder is not None:
            path = self.folder / "volumes" / name
            self._new_masks[path] = partial(_write_mask, path, mask, volume)
            self._write_soon()
        return name

    def read_mask(self, name: str, volume: Volume) -> Mask | None:
        """Return a memory's mask; :class:`TfscopeError` if its file is unreadable. Thread-safe."""
        for known, mask in self._masks.values():
            if known == name:
                return mask
        from model.volume_files.masks import read_mask

        return read_mask((self.folder or Path()) / "volumes" / name, volume) if name else None

    def note_opened(self, fingerprint: str, path: Path) -> None:
        """Remember where a volume was opened; it becomes the first of the recent ones."""
        place = str(path.absolute())
        self.note_volume(fingerprint, path=place)
        self._change_settings(partial(_with_place, place=place, fingerprint=fingerprint))
        self.note_recent("volumes", path)

    def note_model(self, folder: Path, fingerprint: str) -> None:
        """Remember that a model was opened with a volume; it comes first in both lists."""
        models = _first(str(folder.absolute()), self.volume(fingerprint).models)
        self.note_volume(fingerprint, models=models)
        self.note_recent("models", folder)

    def note_recent(self, kind: RecentKind, path: Path) -> None:
        """Put a file first among the recent ones of its kind."""
        self._change_settings(partial(_with_recent, kind=kind, path=path.absolute()))

    def recent(self, kind: RecentKind) -> list[Path]:
        """Return the recent files of a kind, the newest first, whether they exist or not."""
        return [Path(text) for text in getattr(self.settings, f"recent_{kind}")[:MOST_RECENT]]

    def finish(self) -> None:
        """Write all changes, and wait for that."""
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
        # Not restarted at every change, or a long drag would be written only at its end.
        if not (self.folder is None or self._has_failed or self._pause.isActive()):
            self._pause.start()

    def _write(self) -> None:
        if self._writing.is_running:
            # One write at a time, so that an older state never replaces a newer one.
            self._pause.start()
        else:
            self._writing.ask(self._unwritten())

    def _fail(self, text: str) -> None:
        # Reported once, though several writes may fail.
        if not self._has_failed:
            self._has_failed = True
            self._pause.stop()
            self.problem.emit(text)

    def _volume(self, fingerprint: str) -> KeptFile[VolumeMemory]:
        if fingerprint not in self._volumes:
            self._volumes[fingerprint] = volume_file(self.folder, fingerprint)
        return self._volumes[fingerprint]

    def _unwritten(self) -> Callable[[], None]:
        new, self._new_masks = self._new_masks, {}
        files = [file.unwritten() for file in self._volumes.values()]
        writes = [*new.values(), *filter(None, (self._settings.unwritten(), *files))]
        # Removed last: until it is written, a memory may name an old mask.
        writes += [partial(_remove_old_masks, path) for path in new]

        def write() -> None:
            for each in writes:
                each()

        return write


def _write_mask(path: Path, mask: Mask, volume: Volume) -> None:
    """Write a volume's mask unless it exists."""
    # Imported here: a window opens before it reads or writes masks.
    from model.volume_files.masks import write_mask

    if path.exists():
        path.touch()
    else:
        write_mask(path, mask, volume)


def _remove_old_masks(path: Path) -> None:
    """Remove masks that were replaced long ago; newer ones may belong to other windows."""
    start = path.name.partition(".")[0]
    for other in path.parent.glob(f"{start}.*{MASK_END.lstrip('.')}"):
        with suppress(OSError):
            if time.time() - other.stat().st_mtime > OLD_S:
                other.unlink()


def _first(text: str, others: tuple[str, ...]) -> tuple[str, ...]:
    return (text, *(other for other in others if other != text))[:MOST_RECENT]


def _with_recent(settings: Settings, kind: RecentKind, path: Path) -> Settings:
    name = f"recent_{kind}"
    changes: dict[str, Any] = {name: _first(str(path), getattr(settings, name))}
    # Files are neither looked for nor saved among the program's own.
    if kind != "models" and not path.is_relative_to(RESOURCES):
        changes["last_folder"] = str(path.parent)
    return replace(settings, **changes)


def _with_place(settings: Settings, place: str, fingerprint: str) -> Settings:
    others = {p: f for p, f in settings.places.items() if p != place}
    newest = [*others.items(), (place, fingerprint)][-MOST_PLACES:]
    return replace(settings, places=dict(newest))
