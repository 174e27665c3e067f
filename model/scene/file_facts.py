"""What a volume's file says beyond the voxels: its frame, units, and what else it holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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
    is_labels : bool
        Whether the file declares its values to be labels, between which nothing lies.
    """

    format: str = ""
    spacing_unit: str = ""
    directions: tuple[tuple[float, float, float], ...] = ()
    space: str = ""
    contents: tuple[Content, ...] = ()
    is_labels: bool = False
