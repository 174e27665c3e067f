"""The result of the file readers, before it is converted to a volume."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from model.scene.file_facts import FileFacts
from model.scene.volume import Triple


@dataclass(frozen=True, eq=False)
class Grid:
    """Voxels of a file, with one or more components.

    Attributes
    ----------
    values : ndarray, shape (nz, ny, nx) or (nz, ny, nx, components)
        Any real type, native byte order, writable; NaN and infinities allowed.
    spacing, origin : tuple of float
        Along x, y and z.
    units : str
        Unit of the values, empty if unknown.
    notes : tuple of str
        Assumptions and changes made by the reader, for the user.
    axis_labels : tuple of str
        See :class:`~model.scene.volume.Volume`.
    up : str
        Axis that points up, where it is none of a patient's; see
        :class:`~model.scene.volume.Volume`.
    missing : ndarray of bool, shape (nz, ny, nx), or None
        True where the file says that nothing was measured, as by a padding or fill value; None
        where it says nothing. NaN and infinities are missing without it.
    facts : FileFacts
        What else the file says.
    """

    values: NDArray[np.generic]
    spacing: Triple
    origin: Triple = (0.0, 0.0, 0.0)
    units: str = ""
    notes: tuple[str, ...] = ()
    axis_labels: tuple[str, ...] = ()
    up: str = ""
    missing: NDArray[np.bool_] | None = None
    facts: FileFacts = field(default=FileFacts())
