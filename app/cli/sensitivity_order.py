"""The order of ``sensitivity``: an image, and a question about its derivative."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from app.cli.choices import SensitivityEngine
from app.cli.look import Look
from model.scene.region import Region
from model.scene.scene import Lighting
from model.sensitivity.display import Measure
from model.volume_files.source import VolumeSource


@dataclass(frozen=True, kw_only=True)
class SensitivityOrder(Look):
    """Options of the ``sensitivity`` command; see :func:`app.cli.image_commands.sensitivity`."""

    volume: VolumeSource
    model: Path | None
    engine: SensitivityEngine | None
    tf: Path | None
    size: int | None
    region: Region | None
    value: float | None
    block: int | None
    width: float | None
    measure: Measure
    lighting: Lighting | None
    device: str
    out: Path
    by_all_values: bool = False
