"""The order of ``sensitivity``: an image, and a question about its derivative."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from app.cli.choices import SensitivityEngine
from app.cli.look import Look
from model.scene.region import Region
from model.scene.scene import Lighting
from model.sensitivity.measure import Measure
from model.volume_files.source import VolumeSource


@dataclass(frozen=True, kw_only=True)
class SensitivityOrder(Look):
    """Options of the ``sensitivity`` command; see :func:`app.cli.image_commands.sensitivity`.

    Attributes
    ----------
    budget : float or None
        Seconds that the answer may take.
    error : float or None
        1 - cosine that it may have to that of half as many columns.
    """

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
    budget: float | None = None
    error: float | None = None

    @property
    def is_traded(self) -> bool:
        """Whether an error or a time is asked for."""
        return self.error is not None or self.budget is not None

    def scaled(self, part: float) -> SensitivityOrder:
        """Return the order for an image with a part of the columns, of the same region."""
        if self.region is None:
            return self
        left, top, right, bottom = (
            part * edge
            for edge in (
                self.region.left,
                self.region.top,
                self.region.right,
                self.region.bottom,
            )
        )
        region = Region(int(left), int(top), math.ceil(right), math.ceil(bottom))
        return replace(self, region=region)
