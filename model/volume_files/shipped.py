"""The volumes shipped with tfscope."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.transfer_function import TransferFunction
from model.scene.volume import Volume

RESOURCES = Path(__file__).resolve().parents[2] / "resources"

DEFAULT_VOLUME = RESOURCES / "volumes" / "reacting_jet_temperature_112x112x192_float32.nrrd"

SCAN = RESOURCES / "volumes" / "lidc_chest_256x256x133_uint8.nrrd"
"""Shown where nothing is named."""


@dataclass(frozen=True)
class Sample:
    """A shipped volume's subject, and its first look: azimuth and elevation, and light.

    Its TF lies next to it, in a file that ends in ``.tf.json`` in place of ``.nrrd``.
    """

    title: str
    angles: tuple[float, float]
    lighting: Lighting
    light: LightDirection


SAMPLES = {
    SCAN.name: Sample("Chest CT (LIDC)", (0.0, 8.0), "path", LightDirection(-50, 40)),
    DEFAULT_VOLUME.name: Sample(
        "Reacting jet, temperature", (30.0, 8.0), "path", LightDirection(-60, 35)
    ),
    "fly_212x232x144_uint8.nrrd": Sample(
        "Fly (micro-CT)", (190.0, 22.0), "path", LightDirection(-40, 45)
    ),
    "shell_116x48x225_uint8.nrrd": Sample(
        "Sea shell, cut open (micro-CT)", (150.0, 8.0), "path", LightDirection(45, 35)
    ),
}
"""The shipped volumes, by file name."""


def shipped_volumes() -> list[Path]:
    """Return the files of the shipped volumes, in the order in which they are offered."""
    return [RESOURCES / "volumes" / name for name in SAMPLES]


def sample_of(volume: Volume) -> Sample | None:
    """Return what is known of a shipped volume, or None for another one."""
    name = _file_name(volume)
    return None if name is None else SAMPLES[name]


def designed_tf(volume: Volume) -> TransferFunction | None:
    """Return the TF that lies next to a shipped volume, or None for another one."""
    name = _file_name(volume)
    return None if name is None else TransferFunction.load(_beside(RESOURCES / "volumes" / name))


def scan_tf() -> TransferFunction:
    """Return the TF of the shipped scan, whose bytes are :data:`SCAN_HU`."""
    return TransferFunction.load(_beside(SCAN))


SCAN_HU = (-1000.0, 1500.0)
"""Hounsfield units of the shipped scan's least and greatest byte."""


def title_of(path: Path) -> str:
    """Return what a shipped volume is of, in words."""
    return SAMPLES[path.name].title


def picture_of(path: Path) -> Path:
    """Return the file of a shipped volume's picture, 192 pixels wide and high."""
    return path.with_suffix(".png")


def _file_name(volume: Volume) -> str | None:
    """Return the name of a shipped volume's file, by the volume's name and dimensions."""
    x, y, z = volume.dimensions
    start = f"{volume.name.replace(' ', '_')}_{x}x{y}x{z}_"
    return next((name for name in SAMPLES if name.startswith(start)), None)


def _beside(path: Path) -> Path:
    return path.with_suffix(".tf.json")
