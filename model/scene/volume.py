"""The volume: a scalar field on a regular grid, and quantities derived from it."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError

Triple = tuple[float, float, float]


class Geometry(Protocol):
    """Geometry of values on a regular grid; a :class:`Volume` is one.

    Attributes
    ----------
    dimensions : tuple of int
        Number of values along x, y and z.
    spacing, extent : tuple of float
        See :class:`Volume`.
    radius, voxel_size : float
        See :class:`Volume`.
    """

    @property
    def dimensions(self) -> tuple[int, int, int]: ...  # noqa: D102
    @property
    def spacing(self) -> Triple: ...  # noqa: D102
    @property
    def extent(self) -> Triple: ...  # noqa: D102
    @property
    def radius(self) -> float: ...  # noqa: D102
    @property
    def voxel_size(self) -> float: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class Volume:
    """A scalar field sampled on a regular, axis-aligned grid.

    Attributes
    ----------
    scalars : ndarray, shape (nz, ny, nx)
        Finite values of any real numeric type, x fastest, native byte order.
    spacing : tuple of float
        Distance between voxel centres along x, y and z, each > 0.
    origin : tuple of float
        Position of the centre of voxel (0, 0, 0).
    name : str
        Display name, usually the file's stem.
    units : str
        Unit of the scalars, empty when unknown.
    notes : tuple of str
        Changes made by the file reader, each a sentence for the user.
    up : str
        Axis that points up, to a patient's head, such as ``"+z"``; empty when unknown.
    axis_labels : tuple of str
        The patient's direction (R, L, A, P, S or I) that each of
        :data:`~model.scene.orientation.AXES` points to; empty when unknown.

    Raises
    ------
    VolumeError
        When the array is not 3-D, has an axis shorter than two voxels, is not
        numeric, not finite or constant, or when the spacing is not positive.
    """

    scalars: NDArray[np.generic]
    spacing: Triple = (1.0, 1.0, 1.0)
    origin: Triple = (0.0, 0.0, 0.0)
    name: str = "volume"
    units: str = ""
    notes: tuple[str, ...] = field(default=())
    up: str = ""
    axis_labels: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        scalars = self.scalars
        if scalars.ndim != 3 or min(scalars.shape) < 2:
            raise VolumeError(
                f"{self.name}: an array of shape {scalars.shape} is not a volume; "
                "three axes of at least two voxels each are needed."
            )
        if scalars.dtype.kind not in "iuf":
            raise VolumeError(
                f"{self.name}: voxels of type {scalars.dtype} are not real numbers; "
                "convert the file to an integer or floating-point type."
            )
        if not all(np.isfinite(s) and s > 0 for s in self.spacing):
            raise VolumeError(
                f"{self.name}: the spacing {self.spacing} must be positive along every axis; "
                "correct it in the file's header."
            )
        lo, hi = self.scalar_range
        if not (np.isfinite(lo) and np.isfinite(hi)):
            raise VolumeError(f"{self.name}: the volume holds NaN or infinite voxels.")
        if not np.isfinite(hi - lo):
            raise VolumeError(
                f"{self.name}: the values from {lo:g} to {hi:g} span more than a floating-point "
                "number can hold; scale them down."
            )
        if lo == hi:
            raise VolumeError(
                f"{self.name}: every voxel has the value {lo:g}; "
                "a constant volume shows nothing, so choose another file or component."
            )

    @cached_property
    def scalar_range(self) -> tuple[float, float]:
        """Smallest and largest voxel, in the data's own units."""
        return float(self.scalars.min()), float(self.scalars.max())

    @property
    def dimensions(self) -> tuple[int, int, int]:
        """Number of voxels along x, y and z."""
        nz, ny, nx = self.scalars.shape
        return nx, ny, nz

    @property
    def extent(self) -> Triple:
        """Distance between the first and the last voxel centre along x, y and z."""
        x, y, z = ((n - 1) * s for n, s in zip(self.dimensions, self.spacing, strict=True))
        return x, y, z

    @property
    def center(self) -> Triple:
        """Midpoint of the grid, at which every view is aimed."""
        x, y, z = (o + e / 2 for o, e in zip(self.origin, self.extent, strict=True))
        return x, y, z

    @property
    def radius(self) -> float:
        """Half the grid's diagonal: the radius of its bounding sphere."""
        return float(np.linalg.norm(self.extent)) / 2

    @property
    def proportions(self) -> Triple:
        """Lengths along x, y and z relative to the diameter of the bounding sphere."""
        x, y, z = (length / (2 * self.radius) for length in self.extent)
        return x, y, z

    @property
    def voxel_size(self) -> float:
        """Geometric mean of the spacing: the edge of a cube with a voxel's volume.

        It is the unit of the sample distance and the reference length of a
        transfer function's opacities.
        """
        return math.prod(self.spacing) ** (1 / 3)

    def histogram(self, bins: int = 256) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Count voxels per scalar value.

        Parameters
        ----------
        bins : int
            Number of equal bins over the scalar range.

        Returns
        -------
        counts : ndarray of int64, shape (bins,)
        edges : ndarray of float64, shape (bins + 1,)
            In the data's own units.
        """
        # Slice by slice: `np.histogram` would otherwise copy the whole volume to float64.
        edges = np.linspace(*self.scalar_range, bins + 1)
        counts = np.zeros(bins, dtype=np.int64)
        for plane in self.scalars:
            counts += np.histogram(plane, bins=edges)[0]
        return counts, edges

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of the voxels, their type, shape and spacing."""
        digest = hashlib.sha256()
        little = self.scalars.dtype.newbyteorder("<")
        spacing = [float(s) for s in self.spacing]
        digest.update(f"{little.str} {self.dimensions} {spacing}".encode())
        digest.update(np.ascontiguousarray(self.scalars.astype(little, copy=False)).data)
        return digest.hexdigest()
