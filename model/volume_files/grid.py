"""What the reader of each format hands back, before a volume is made of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.volume import Triple


@dataclass(frozen=True, eq=False)
class Grid:
    """The voxels of a file as they are, with one or more components.

    Attributes
    ----------
    values : ndarray, shape (nz, ny, nx) or (nz, ny, nx, components)
        Any real type, native byte order, writable; NaN and infinities allowed.
    spacing, origin : tuple of float
        Along x, y and z.
    units : str
        Unit of the values, empty when unknown.
    notes : tuple of str
        What had to be assumed or changed.
    """

    values: NDArray[np.generic]
    spacing: Triple
    origin: Triple = (0.0, 0.0, 0.0)
    units: str = ""
    notes: tuple[str, ...] = ()
