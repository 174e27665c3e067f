"""The models that come with tfscope."""

from __future__ import annotations

import json
from pathlib import Path

from model.volume_files import read_volume
from model.volume_files.shipped import RESOURCES, shipped_volumes


def shipped_models() -> list[Path]:
    """Folders of the models that are there, in alphabetical order."""
    return sorted(path.parent for path in (RESOURCES / "models").glob("*/model.json"))


def volume_for(model: Path) -> Path | None:
    """The shipped volume that a model was trained on, if it is one of those."""
    fingerprint = _fingerprint(model)
    if fingerprint is None:
        return None
    volumes = (path for path in shipped_volumes() if read_volume(path).fingerprint == fingerprint)
    return next(volumes, None)


def model_for(volume_fingerprint: str) -> Path | None:
    """The shipped model of a volume, if there is one."""
    folders = (f for f in shipped_models() if _fingerprint(f) == volume_fingerprint)
    return next(folders, None)


def _fingerprint(model: Path) -> str | None:
    """The volume's that a model was trained on; None where its description cannot be read.

    Reads it as plain JSON: torch, which takes seconds to import, is not needed for that.
    """
    try:
        description = json.loads((model / "model.json").read_text(encoding="utf-8"))
        return str(description["scene"]["volume_fingerprint"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
