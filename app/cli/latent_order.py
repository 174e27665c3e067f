"""What the ``latent`` command is asked; checked before anything heavy is imported."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from model.errors import LatentError
from model.scene.view import View
from model.volume_files.source import VolumeSource

Place = tuple[float, float]
"""Place on the map."""

Brush = tuple[float, float, float, float]
"""Rectangle on the map: left, lower, right and upper edge."""


@dataclass(frozen=True)
class LatentOrder:
    """Options of the ``latent`` command; see :func:`app.cli.latent_commands.latent`.

    Raises
    ------
    LatentError
        For several questions at once, for a TF file without a TF, and for a range beside a
        model's own.
    """

    volume: VolumeSource
    model: Path | None
    grid: Brush | None
    at: Place | None
    near: Path | None
    view: View
    tf: Path | None
    size: int
    out: Path

    def __post_init__(self) -> None:
        if self.near is not None and (self.grid is not None or self.at is not None):
            raise LatentError(
                "Give --near alone: beside --grid and --at it would be a second place."
            )
        if self.model is not None and self.volume.is_placed:
            raise LatentError(
                "A model draws over the range and scale that it was trained on; leave --range and "
                "--scale out."
            )
        if self.out.suffix.lower() == ".json" and self.at is None and self.near is None:
            raise LatentError(
                f"{self.out}: a JSON file holds one TF; say which by --at or --near.", at="0,0"
            )
