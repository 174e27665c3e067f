"""The volumes and models that come with tfscope."""

from __future__ import annotations

import json
from pathlib import Path

RESOURCES = Path(__file__).resolve().parent.parent / "resources"

DEFAULT_VOLUME = RESOURCES / "volumes" / "reacting_jet_temperature_112x112x192_float32.nrrd"


def shipped_models() -> list[Path]:
    """Folders of the models that are there, in alphabetical order."""
    return sorted(path.parent for path in (RESOURCES / "models").glob("*/model.json"))


def shipped_volumes() -> list[Path]:
    """Files of the volumes that are there, in alphabetical order."""
    return sorted((RESOURCES / "volumes").glob("*.nrrd"))


def model_for(volume_fingerprint: str) -> Path | None:
    """The shipped model of a volume, if there is one.

    Reads the models' descriptions as plain JSON: torch, which takes seconds to
    import, is not needed to find one.
    """
    for folder in shipped_models():
        try:
            description = json.loads((folder / "model.json").read_text(encoding="utf-8"))
            if description["scene"]["volume_fingerprint"] == volume_fingerprint:
                return folder
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return None
