"""Requests to the window at its start: what to open and show."""

from dataclasses import dataclass
from pathlib import Path

from app.engines.requests import Drawing
from model.errors import TfscopeError
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.ranges import RangeChoice
from model.scene.scene import LightDirection, Lighting
from model.scene.value_scale import ValueScale
from model.scene.view import View
from model.volume_files.choice import Choice


@dataclass(frozen=True)
class WindowStart:
    """Files, view and looks that the window starts with; None leaves the choice to the window."""

    volume: Path  # also a session's
    model: Path | None = None
    tf: Path | None = None
    view: View | None = None
    lighting: Lighting | None = None
    light: LightDirection | None = None
    renderer: Drawing | None = None
    scalar_range: RangeChoice | None = None
    scale: ValueScale | None = None
    crop: CropBox | None = None
    clip: ClipPlane | None = None
    size: tuple[int, int] | None = None
    choice: Choice | None = None
    session: Path | None = None

    def __post_init__(self) -> None:
        if self.light is not None and self.lighting == "none":
            raise TfscopeError("An unlit image has no light to move.", lighting="direct")
