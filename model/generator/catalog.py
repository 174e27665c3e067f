"""The models shipped with tfscope."""

from __future__ import annotations

from pathlib import Path

from model.json_files import read_json
from model.networks.size import Architecture
from model.volume_files import read_volume
from model.volume_files.shipped import RESOURCES, shipped_volumes

START_ARCHITECTURE: Architecture = "refined"
"""Architecture of the shipped model that a volume is opened with; of another where there is none.

"paper" opens volumes with the paper's networks.
"""


def shipped_models() -> list[Path]:
    """Return the folders of the shipped models, in alphabetical order."""
    return sorted(path.parent for path in (RESOURCES / "models").glob("*/model.json"))


def volume_for(model: Path) -> Path | None:
    """Return the shipped volume that a model was trained on, or None if it is not shipped."""
    fingerprint = _fingerprint(model)
    if fingerprint is None:
        return None
    volumes = (path for path in shipped_volumes() if read_volume(path).fingerprint == fingerprint)
    return next(volumes, None)


def model_for(volume_fingerprint: str) -> Path | None:
    """Return the first shipped model of a volume in alphabetical order, or None without any.

    Those of :data:`START_ARCHITECTURE` come before others.
    """
    folders = [f for f in shipped_models() if _fingerprint(f) == volume_fingerprint]
    first = [f for f in folders if _described(f, "size", "architecture") == START_ARCHITECTURE]
    return next(iter([*first, *folders]), None)


def _fingerprint(model: Path) -> str | None:
    """Return the fingerprint of a model's volume; None if its description cannot be read."""
    return _described(model, "scene", "volume_fingerprint")


def _described(model: Path, part: str, name: str) -> str | None:
    """Return a text of a model's description; None if it cannot be read.

    The description is read as plain JSON, to avoid importing torch, which takes seconds.
    """
    try:
        return str(read_json(model / "model.json")[part][name])
    except (OSError, ValueError, KeyError, TypeError):
        return None
