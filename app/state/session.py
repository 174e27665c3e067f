"""A session: all that brings a window's picture back, as a file (``.tfscope``).

Its fields are those of :mod:`.known_volume`, :mod:`.remembered` and the choices of sensitivities
that are declared to belong to a session, and the few that are nowhere else.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from app.state.kept_fields import checks_of
from app.state.known_volume import KnownRegion, KnownVolume
from app.state.remembered import Remembered
from app.state.sensitivity_state import Choices
from app.state.value_checks import checked, flag, list_of, number, text, whole_number
from model.errors import TfscopeError, reason
from model.files import write_atomically
from model.json_files import read_json
from model.scene.transfer_function import TransferFunction
from model.volume_files.shipped import shipped_volumes

SUFFIX = ".tfscope"
VERSION = 1


class SessionError(TfscopeError):
    """A session's file cannot be read or written."""


@dataclass(frozen=True)
class Session:
    """All that a window shows.

    Attributes
    ----------
    volume : Path
        The volume's file or folder.
    fingerprint : str
        Checksum of its voxels.
    transfer_function : TransferFunction
        Over the range, and on the scale, that the volume is shown on.
    look : dict
        Values of a :class:`KnownVolume` that belong to a session, by name.
    window : dict
        Values of :class:`Remembered` that belong to a session, by name.
    band : tuple of float
        Lowest and highest of the pinned scalar values; empty if none are.
    browsing : bool
        Whether the latent browser is open.
    model : Path or None
        Folder of the open model.
    """

    volume: Path
    fingerprint: str
    transfer_function: TransferFunction
    look: Mapping[str, Any] = field(default_factory=dict)
    window: Mapping[str, Any] = field(default_factory=dict)
    sensitivity: Choices = field(default_factory=Choices)
    band: tuple[float, ...] = ()
    browsing: bool = False
    model: Path | None = None

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all.

        Paths stand in it as they are, and relative to its folder, so that volume and session can
        move together.

        Raises
        ------
        SessionError
            When it cannot be written.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, json.dumps(self._to_json(path), indent=1).encode())
        except OSError as error:
            raise SessionError(
                f"{path}: the session cannot be written ({reason(error)}); choose another place."
            ) from error

    @classmethod
    def load(cls, path: Path) -> Session:
        """Read the file; volume and model are where they are found now.

        Raises
        ------
        SessionError
            When it cannot be read, is damaged, or of a newer version.
        """
        try:
            return cls._from_json(read_json(path), path)
        except OSError as error:
            raise SessionError(
                f"{path}: the session cannot be read ({reason(error)}); choose another."
            ) from error
        except (ValueError, TfscopeError) as error:
            raise SessionError(
                f"{path}: this is no session that can be opened ({error}); nothing was changed."
            ) from error

    def _to_json(self, path: Path) -> dict[str, Any]:
        return {
            "tfscope_session": VERSION,
            "volume": {**_written(self.volume, path), "fingerprint": self.fingerprint},
            "model": None if self.model is None else _written(self.model, path),
            "transfer_function": self.transfer_function.to_json(),
            "look": {name: _plain(value) for name, value in self.look.items()},
            "window": dict(self.window),
            "sensitivity": of_session(self.sensitivity),
            "band": list(self.band),
            "browsing": self.browsing,
        }

    @classmethod
    def _from_json(cls, data: Any, path: Path) -> Session:
        if not isinstance(data, dict) or "tfscope_session" not in data:
            raise ValueError("it does not hold a session of tfscope")
        version = whole_number(1, 10**9)(data["tfscope_session"])
        if version > VERSION:
            raise ValueError(f"it was written by a newer tfscope, in version {version}")
        volume = _part(data, "volume")
        sensitivity = _checked(Choices, _part(data, "sensitivity"))
        band = list_of(number(-1e300, 1e300), 2)(data.get("band", ()))
        if len(band) == 1 or (band and band[0] > band[1]):
            raise ValueError("'band' must have a lowest and a highest value, or none")
        return cls(
            volume=_found(volume, path),
            fingerprint=text(volume.get("fingerprint")),
            transfer_function=TransferFunction.from_json(data.get("transfer_function")),
            look=_checked(KnownVolume, _part(data, "look")),
            window=_checked(Remembered, _part(data, "window")),
            sensitivity=Choices(**sensitivity),
            band=band,
            browsing=flag(data.get("browsing", False)),
            model=None if data.get("model") is None else _found(_part(data, "model"), path),
        )


def of_session(kept: KnownVolume | Remembered | Choices) -> dict[str, Any]:
    """Return the values that belong to a session, by name."""
    return {name: getattr(kept, name) for name in checks_of(type(kept), in_session=True)}


def _checked(table: type, data: dict[str, Any]) -> dict[str, Any]:
    """Return the values that are known; those of a later version are left out."""
    checks = checks_of(table, in_session=True)
    return {name: checked(checks, name, value) for name, value in data.items() if name in checks}


def _part(data: dict[str, Any], name: str) -> dict[str, Any]:
    part = data.get(name, {})
    if not isinstance(part, dict):
        raise ValueError(f"'{name}' must have names")
    return part


def _written(place: Path, session: Path) -> dict[str, str]:
    """Return where a file or folder is: itself, and seen from the session's folder."""
    place = place.absolute()
    try:
        beside = Path(os.path.relpath(place, session.absolute().parent)).as_posix()
    except ValueError:
        # On another drive.
        beside = ""
    return {"path": str(place), "beside": beside}


def _found(written: dict[str, Any], session: Path) -> Path:
    """Return where a file or folder is now, or where it was if it is nowhere."""
    folder, place = session.absolute().parent, Path(text(written.get("path")))
    beside = text(written.get("beside", ""))
    # What has moved along with the session comes before what was left behind.
    places = [folder / beside] if beside else []
    places += [place, folder / place.name]
    places += [each for each in shipped_volumes() if each.name == place.name]
    return next((each.resolve() for each in places if each.exists()), place)


def _plain(value: Any) -> Any:
    """Return a value of a session as plain data."""
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    return asdict(value) if isinstance(value, KnownRegion) else value
