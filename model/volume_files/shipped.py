"""The volumes shipped with tfscope."""

from __future__ import annotations

from pathlib import Path

RESOURCES = Path(__file__).resolve().parents[2] / "resources"

DEFAULT_VOLUME = RESOURCES / "volumes" / "reacting_jet_temperature_112x112x192_float32.nrrd"


def shipped_volumes() -> list[Path]:
    """Return the files of the shipped volumes, in alphabetical order."""
    return sorted((RESOURCES / "volumes").glob("*.nrrd"))
