"""A session: everything that restores a window's picture, as a file (``.tfscope``)."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path, PureWindowsPath
from typing import Any

from PySide6.QtGui import QImageReader

from app.state.latent_session import LatentChoices
from app.state.sensitivity_state import Choices
from app.state.settings import Place, SessionSettings, Share, VolumeMemory
from model.errors import TfscopeError, os_errors_as
from model.files import write_atomically
from model.json_files import MalformedError, build, build_valid, parse_json, read_json
from model.scene.transfer_function import Range
from model.volume_files.shipped import shipped_volumes

SUFFIX, FIGURE_SUFFIX = ".tfscope", ".png"
FIGURE_TEXT = "Session"  # name of the text of a figure's file that holds its session
VERSION = 2


class SessionError(TfscopeError):
    """A session's file cannot be read or written."""


@dataclass(frozen=True)
class SessionContent:
    """Content of a session besides files; the band holds kept values."""

    memory: VolumeMemory = field(default_factory=VolumeMemory)
    settings: SessionSettings = field(default_factory=SessionSettings)
    sensitivity: Choices = field(default_factory=Choices)
    band: Range | None = None
    latent: LatentChoices = field(default_factory=LatentChoices)
    wipe: Share | None = None  # A's share of the width, where A and B are in one image
    line: tuple[Place, Place] | None = None  # ends of the measured line
    difference: bool = False  # whether the difference of the images is shown


@dataclass(frozen=True)
class Session:
    """Everything that a window shows."""

    volume: Path
    fingerprint: str  # of the volume
    content: SessionContent = field(default_factory=SessionContent)
    model: Path | None = None
    wrong: tuple[str, ...] = ()  # names of wrong entries in the file, which are ignored

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all; raise :class:`SessionError` if that fails.

        It also has paths relative to its folder, so that volume and session can move together.
        """
        what = f"{path}: the session cannot be written"
        with os_errors_as(SessionError, what, "make room, or choose another place"):
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, self.text(path).encode())

    def text(self, path: Path | None = None) -> str:
        """Return a file's content; without a path that of a figure, which names no folder."""

        def written(place: Path) -> dict[str, str]:
            return {"path": place.name} if path is None else _written(place, path)

        data = {
            "tfscope_session": VERSION,
            "volume": {**written(self.volume), "fingerprint": self.fingerprint},
            "model": None if self.model is None else written(self.model),
            **asdict(self.content),
        }
        text = json.dumps(data, indent=1 if path else None)
        # In an image's text, Qt reads several spaces as one.
        return text if path else text.replace("  ", r" \u0020")

    @classmethod
    def load(cls, path: Path) -> Session:
        """Read a session or figure, and find volume and model; else raise `SessionError`."""
        what = f"{path}: the session cannot be read"
        try:
            with os_errors_as(SessionError, what, "choose another"):
                return cls._from_json(_read(path), path)
        except ValueError as error:
            raise SessionError(
                f"{path}: this session cannot be opened ({error}); nothing was changed."
            ) from error

    @classmethod
    def _from_json(cls, data: Any, path: Path) -> Session:
        if not isinstance(data, dict) or type(data.get("tfscope_session")) is not int:
            raise MalformedError("the file is not a tfscope session")
        version = data["tfscope_session"]
        if version > VERSION:
            raise MalformedError(f"a newer tfscope wrote it, in format {version}")
        if version < VERSION:
            raise MalformedError(f"a tfscope before 0.1 wrote it, in format {version}")
        volume = build(_Place, data.get("volume"))
        content, wrong = build_valid(SessionContent, data)
        model = None
        if data.get("model") is not None:
            model = _found(build(_Place, data["model"]), path)
        return cls(_found(volume, path), volume.fingerprint, content, model, tuple(wrong))


def _read(path: Path) -> Any:
    """Read a session's file, or what a figure's file holds of one; None if that is nothing."""
    if path.suffix.lower() != FIGURE_SUFFIX:
        return read_json(path)
    path.stat()  # so that a missing file is an error
    text = QImageReader(str(path)).text(FIGURE_TEXT)
    return parse_json(text.encode()) if text else None


def kept_mask(session: Path, memory: VolumeMemory) -> Path | None:
    """Return the mask's file next to that of a session with a memory; None if there is none."""
    if not memory.mask or session.suffix.lower() == FIGURE_SUFFIX:
        return None
    # Always in the session's own folder.
    return session.absolute().with_name(Path(memory.mask).name)


@dataclass(frozen=True)
class _Place:
    path: str
    beside: str = ""
    fingerprint: str = ""


def _written(place: Path, session: Path) -> dict[str, str]:
    """Return the absolute path of a file or folder, and that relative to the session's folder."""
    place = place.absolute()
    try:
        beside = Path(os.path.relpath(place, session.absolute().parent)).as_posix()
    except ValueError:
        # On another drive.
        beside = ""
    return {"path": str(place), "beside": beside}


def _found(written: _Place, session: Path) -> Path:
    """Return the present path of a file or folder, or the old one if it is not found."""
    folder, place = session.absolute().parent, Path(written.path)
    # This also works for Windows paths on other systems.
    name = PureWindowsPath(written.path).name
    # Files that moved with the session come before those that stayed.
    places = [folder / written.beside] if written.beside else []
    places += [place, folder / place.name, folder / name]
    places += [each for each in shipped_volumes() if each.name == name]
    return next((each.resolve() for each in places if each.exists()), place)
