"""What a volume's file says beyond the voxels: its frame, units, and what else it holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from model.scene.transfer_function import TransferFunction
from model.scene.view import View

ChoiceKind = Literal["series", "array", "time", "channel", "component"]
"""Along what a file holds more than one volume."""


@dataclass(frozen=True)
class Content:
    """One of the volumes that a file or folder holds.

    Attributes
    ----------
    kind : {"series", "array", "time", "channel", "component"}
        What sets it apart from the others of the same kind.
    name : str
        The file's own name of it, or its number among those of its kind, from 0.
    dimensions : tuple of int
        Number of voxels along x, y and z.
    scalar_type : str
        NumPy's name of the type, for example ``"uint16"``.
    nbytes : int
        Size of the voxels, uncompressed.
    is_read : bool
        Whether it is the one that was read.
    """

    kind: ChoiceKind
    name: str
    dimensions: tuple[int, ...]
    scalar_type: str
    nbytes: int
    is_read: bool = False


@dataclass(frozen=True)
class FileFacts:
    """What the file of a volume says about it; each part is empty where the file is silent.

    Attributes
    ----------
    format : str
        Name of the format, for example ``"NIfTI-1"``.
    spacing_unit : str
        Unit of spacing and origin, for example ``"mm"``.
    directions : tuple of tuple of float
        Unit vectors along the grid's axes x, y and z in the file's space.
    space : str
        Directions of that space's axes in the patient, such as ``"LPS"``; empty for others.
    contents : tuple of Content
        All that the file or folder holds, where that is more than one volume.
    tf : TransferFunction or None
        The one to show the volume through at first, over the range to show it over.
    view : View or None
        The one to see it from at first.
    up : str
        Axis of the volume that points up, where the file says it other than by its space.
    is_lossy : bool
        Whether the voxels are a compressed copy's, near to what they were.
    image_error : float or None
        How far images of such a copy are from the original's, RMSE of colours in [0, 1], as it
        was measured when the copy was made; None where nothing is lost, or it is not known.
    """

    format: str = ""
    spacing_unit: str = ""
    directions: tuple[tuple[float, float, float], ...] = ()
    space: str = ""
    contents: tuple[Content, ...] = ()
    tf: TransferFunction | None = None
    view: View | None = None
    up: str = ""
    is_lossy: bool = False
    image_error: float | None = None
