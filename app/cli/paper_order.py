"""Order of the ``paper`` command: its options as data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from app.cli.choices import PaperItem
from model.scene.view import View
from model.volume_files.source import VolumeSource

QUICK_COUNT = 12
"""Hold-out samples of ``--quick``."""


@dataclass(frozen=True)
class PaperOrder:
    """Options of the ``paper`` command; see :func:`app.cli.paper_commands.paper`."""

    item: PaperItem
    out: Path
    models: tuple[Path, ...]
    volume: VolumeSource
    view: View
    tf: Path | None
    count: int | None
    dataset: Path | None
    minutes: float
    quick: bool
    workers: int | None
    device: str

    def samples(self, usual: int) -> int:
        """Return the number of hold-out samples where it is usually so many."""
        return self.count or (QUICK_COUNT if self.quick else usual)
