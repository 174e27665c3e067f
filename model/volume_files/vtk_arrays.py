"""The arrays of VTK image data: at points or in cells, and what their ghost types hide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.file_facts import Content, FileFacts
from model.volume_files.arrays import is_auxiliary
from model.volume_files.checks import check_grid, damaged
from model.volume_files.choice import Choice, choice_notes, chosen_index
from model.volume_files.frame import (
    frame_notes,
    unit_directions,
)
from model.volume_files.grid import Grid
from model.volume_files.upright import placed
from model.volume_files.vtk_session import to_numpy

GHOSTS, VALID = ("vtkGhostType", "vtkGhostLevels"), "vtkValidPointMask"
HIDDEN_POINT, HIDDEN_CELL = 2, 32
"""Bits of ghost types."""


@dataclass(frozen=True)
class VtkArray:
    """An array of a file.

    Attributes
    ----------
    in_cells : bool
        Whether its values belong to the cells between the points.
    dtype : numpy.dtype or None
        None where it is not known without reading.
    is_active : bool
        Whether the file names it as its scalars.
    """

    name: str
    in_cells: bool
    dtype: np.dtype[np.generic] | None
    components: int = 1
    is_active: bool = False

    @property
    def is_ghost(self) -> bool:
        """Whether it only tells which voxels there are."""
        return self.name in (*GHOSTS, VALID)


def chosen_array(
    path: Path, arrays: Sequence[VtkArray], choice: Choice
) -> tuple[VtkArray, list[VtkArray]]:
    """Return the chosen array, and all that can be chosen.

    By default it is the first that is no list of ids, ghost types or mask; the active scalars
    before others, and arrays at points before those in cells.
    """
    if any(not isinstance(array.name, str) for array in arrays):
        # VTK gives bytes where it cannot decode them.
        raise damaged(path, "the name of an array is no text")
    usable = [array for array in arrays if not array.is_ghost]
    if not usable:
        raise VolumeError(
            f"{path}: the file holds no values, neither at the grid's points nor in its cells; "
            "save it with an array."
        )
    usable.sort(key=lambda array: (is_auxiliary(array.name), not array.is_active, array.in_cells))
    names = [_title(array, usable) for array in usable]
    number = chosen_index(path, "array", names, choice.array)
    return usable[number], usable


def _title(array: VtkArray, arrays: Sequence[VtkArray]) -> str:
    name = array.name or "unnamed"
    twice = sum(other.name == array.name for other in arrays) > 1
    return f"{name} (cells)" if array.in_cells and twice else name


def image_grid(
    path: Path,
    image: Any,
    wanted: VtkArray,
    arrays: Sequence[VtkArray],
    file_format: str,
    extent: Sequence[int] | None = None,
) -> Grid:
    """Return an array of a VTK image as a grid.

    Parameters
    ----------
    image : vtkImageData
        With that array, and ghost types of the same place.
    arrays : sequence of VtkArray
        All of the file that can be chosen.
    extent : sequence of int or None
        First and last point along each axis of the part that the file has; None for all.
    """
    attributes = image.GetCellData() if wanted.in_cells else image.GetPointData()
    array = attributes.GetArray(wanted.name) if wanted.name else attributes.GetArray(0)
    less = 1 if wanted.in_cells else 0
    dimensions = [n - less for n in image.GetDimensions()]
    if array is None or array.GetNumberOfTuples() != int(np.prod(dimensions)):
        raise damaged(path, f"its array '{wanted.name}' has no values, or not those of its grid")
    values = to_numpy(array, tuple(dimensions))
    check_grid(path, dimensions, values.dtype, values.shape[3] if values.ndim == 4 else 1)
    missing = _hidden(attributes, dimensions, wanted.in_cells)
    first = list(image.GetExtent()[::2])
    if extent is not None:
        starts = [extent[2 * k] - first[k] for k in range(3)]
        stops = [extent[2 * k + 1] - first[k] + 1 - less for k in range(3)]
        part = tuple(slice(starts[k], stops[k]) for k in (2, 1, 0))
        values = values[part]
        missing = None if missing is None else missing[part]
        first = [extent[0], extent[2], extent[4]]
    matrix = image.GetDirectionMatrix()
    directions = np.array([[matrix.GetElement(r, c) for r in range(3)] for c in range(3)])
    steps = list(image.GetSpacing())
    place = [at + less / 2 for at in first]
    origin = np.array(image.GetOrigin()) + np.multiply(place, steps) @ directions
    right = placed(values, steps, origin.tolist(), directions, missing=missing)
    listed = _contents(wanted, arrays, image, right.values)
    notes = choice_notes(listed) + right.notes
    if wanted.in_cells:
        notes += (f"The values of '{wanted.name}' belong to cells; each is a voxel.",)
    turned = directions if right.directions is None else right.directions
    return Grid(
        right.values,
        right.spacing,
        right.origin,
        notes=notes + frame_notes(turned),
        missing=right.missing,
        facts=FileFacts(file_format, "", unit_directions(turned), "", listed),
    )


def _hidden(attributes: Any, dimensions: Sequence[int], in_cells: bool) -> NDArray[np.bool_] | None:
    """Return where values are blanked by ghost types or a mask of valid points."""
    size = int(np.prod(dimensions))
    hidden: NDArray[np.bool_] | None = None
    for name in (GHOSTS[0], VALID):
        array = attributes.GetArray(name)
        if array is None or array.GetNumberOfTuples() != size:
            continue
        flags = to_numpy(array, tuple(dimensions))  # type: ignore[arg-type]
        if flags.ndim != 3 or flags.dtype.kind not in "iu":
            continue
        bit = flags.dtype.type(HIDDEN_CELL if in_cells else HIDDEN_POINT)
        found = flags == 0 if name == VALID else (flags & bit) != 0  # type: ignore[operator]
        hidden = found if hidden is None else hidden | found
    return hidden if hidden is not None and hidden.any() else None


def _contents(
    wanted: VtkArray, arrays: Sequence[VtkArray], image: Any, values: NDArray[np.generic]
) -> tuple[Content, ...]:
    """List all arrays."""
    if len(arrays) < 2:
        return ()
    listed = []
    for array in arrays:
        nx, ny, nz = (n - array.in_cells for n in image.GetDimensions())
        dtype = array.dtype
        if array is wanted:
            nz, ny, nx = values.shape[:3]
            dtype = values.dtype
        size = 0 if dtype is None else nx * ny * nz * dtype.itemsize * array.components
        listed.append(
            Content(
                "array",
                _title(array, arrays),
                (nx, ny, nz),
                "" if dtype is None else dtype.name,
                size,
                array is wanted,
            )
        )
    return tuple(listed)
