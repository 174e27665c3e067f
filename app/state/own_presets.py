"""The user's own presets: TF files in a folder of their own, named as the presets are."""

from __future__ import annotations

import re
from pathlib import Path

from model.errors import TransferFunctionError, reason
from model.scene.transfer_function import TransferFunction

SUFFIX = ".json"


def own_presets(folder: Path | None) -> dict[str, TransferFunction]:
    """Return the TFs that were saved in a user's folder, by name; damaged files are left out."""
    found = {}
    for path in sorted(_place(folder).glob(f"*{SUFFIX}")) if folder else ():
        try:
            found[path.stem] = TransferFunction.load(path)
        except TransferFunctionError:
            continue
    return found


def preset_name(text: str) -> str:
    """Return a name that a file can have; empty where nothing is left of it."""
    return re.sub(r"[^\w .+=()-]+", "_", text).strip(" ._")[:60]


def save_own_preset(folder: Path, name: str, tf: TransferFunction) -> None:
    """Save a TF; raise :class:`TransferFunctionError` where it cannot be written."""
    place = _place(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TransferFunctionError(
            f"{place}: the preset cannot be written ({reason(error)}); use File > Save TF."
        ) from error
    tf.save(place / f"{name}{SUFFIX}")


def remove_own_preset(folder: Path, name: str) -> None:
    """Remove a saved TF, if it is there; raise :class:`TransferFunctionError` if that fails."""
    path = _place(folder) / f"{name}{SUFFIX}"
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise TransferFunctionError(
            f"{path}: the preset cannot be removed ({reason(error)}); check your permissions."
        ) from error


def _place(folder: Path) -> Path:
    return folder / "presets"
