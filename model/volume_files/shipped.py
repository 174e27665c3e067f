"""The volumes shipped with tfscope."""

from __future__ import annotations

from pathlib import Path

RESOURCES = Path(__file__).resolve().parents[2] / "resources"

DEFAULT_VOLUME = RESOURCES / "volumes" / "reacting_jet_temperature_112x112x192_float32.nrrd"

SCAN = RESOURCES / "volumes" / "lidc_chest_256x256x133_uint8.nrrd"
"""Shown first in path-traced light: scans gain most by it."""

TITLES = {
    "lidc_chest_256x256x133_uint8.nrrd": "Chest CT (LIDC)",
    "reacting_jet_temperature_112x112x192_float32.nrrd": "Reacting jet, temperature",
}
"""Titles of the shipped volumes, by file name."""


def shipped_volumes() -> list[Path]:
    """Return the files of the shipped volumes, in alphabetical order."""
    return sorted((RESOURCES / "volumes").glob("*.nrrd"))


def title_of(path: Path) -> str:
    """Return what a shipped volume is of, in words."""
    return TITLES[path.name]


def picture_of(path: Path) -> Path:
    """Return the file of a shipped volume's picture, 192 pixels wide and high."""
    return path.with_suffix(".png")
