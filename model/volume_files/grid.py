"""The result of the file readers, before it is converted to a volume."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from model.scene.volume import FileFacts, Triple


@dataclass(frozen=True, eq=False)
class Grid:
    """Voxels of a file, with one or more components, along x, y and z.

    Values have any real type, native byte order and shape (nz, ny, nx) or (nz, ny, nx, components);
    NaN and infinities are missing. `missing`, shape (nz, ny, nx), marks what the file says was not
    measured. `up` is the axis that points up where it is none of a patient's.
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
