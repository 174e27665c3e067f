"""Memory of a volume: what is kept of it for the next time, and in sessions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from app.state.sensitivity_state import NamedRegion
from model.scene.crop import CropBox
from model.scene.scene import LightDirection, Lighting
from model.scene.transfer_function import Range, TransferFunction
from model.scene.view import View

LightingChoice = Literal["auto"] | Lighting
"""A lighting of the reference image, or the one that suits model and machine."""

PlotScale = Literal["linear", "logarithmic"]


@dataclass(frozen=True)
class VolumeMemory:
    """Memory of one volume; None or empty for what the user has not chosen.

    Attributes
    ----------
    path : str
        Where it was opened last. A session says that elsewhere.
    models : tuple of str
        Folders of models that were opened with it, the newest first; no part of a session.
    tf : TransferFunction or None
        The last one, over the range and on the scale that the volume was shown on.
    up_axis : str
        Axis that the user has turned up; empty for the file's own.
    raw_layout : str
        Layout to read a headerless file with, see :meth:`RawLayout.parse`.
    choice : str
        What was chosen of a file of several volumes, see :meth:`Choice.parse`.
    lighting : {"auto", "none", "direct", "soft", "path"}
        Of the reference image.
    light : LightDirection or None
        Where the user has moved the light.
    brightness : float or None
        Factor of the images' colours; None for the usual one of the light.
    draws_missing : bool
        Whether voxels are drawn where nothing was measured.
    active_region : str
        Name of the active one; empty for the whole image.
    region_count : int
        Number of the last region that was numbered.
    value_scale, opacity_scale : {"linear", "logarithmic"}
        Of the TF's plot.
    visible : tuple of float or None
        Lowest and highest scalar value in sight in the TF's plot.
    """

    path: str = ""
    models: tuple[str, ...] = ()
    tf: TransferFunction | None = None
    up_axis: Literal["", "+x", "-x", "+y", "-y", "+z", "-z"] = ""
    raw_layout: str = ""
    choice: str = ""
    view: View | None = None
    lighting: LightingChoice = "auto"
    light: LightDirection | None = None
    brightness: Annotated[float, Meta(ge=0.25, le=32.0)] | None = None
    crop: CropBox | None = None
    draws_missing: bool = False
    regions: tuple[NamedRegion, ...] = ()
    active_region: str = ""
    region_count: Annotated[int, Meta(ge=0, le=10**9)] = 0
    value_scale: PlotScale = "linear"
    opacity_scale: PlotScale = "linear"
    visible: Range | None = None
