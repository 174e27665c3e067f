"""The volume: a scalar field on a regular grid, with derived quantities.

Volumes over other ranges or scales, or with missing voxels drawn, share derived quantities, so all
of this is in one module.
"""

from __future__ import annotations

import copy
import hashlib
import math
import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.distribution import Distribution, Range
from model.scene.filling import fill
from model.scene.value_scale import ValueScale, logarithms, value_at

THICK = 1.6  # longest side of thick slices' voxels, in shortest ones

ChoiceKind = Literal["series", "array", "time", "channel", "component"]  # of several volumes


class Caution(str):
    """A note on shapes or brightness that may mislead, which the user has to dismiss."""

    __slots__ = ()


@dataclass(frozen=True)
class Content:
    """One of the volumes that a file or folder holds."""

    kind: ChoiceKind  # its name among the others of the same kind
    name: str  # the file's own name of it, or its number among those of its kind, from 0
    dimensions: tuple[int, ...]  # number of voxels along x, y and z
    scalar_type: str  # NumPy's name of the type, for example ``"uint16"``
    nbytes: int  # size of the voxels, uncompressed
    is_read: bool = False  # whether it was read


@dataclass(frozen=True)
class Label:
    """A value of a volume of labels with its meaning; name and colour may be unknown."""

    value: int
    name: str = ""
    color: tuple[float, float, float] | None = None  # red, green and blue, 0 to 1
    number: int | None = None  # the file's value, if different


@dataclass(frozen=True)
class FileFacts:
    """Properties of a volume's file; each is empty if unknown."""

    format: str = ""  # name of the format, for example ``"NIfTI-1"``
    spacing_unit: str = ""  # unit of spacing and origin, for example ``"mm"``
    directions: tuple[tuple[float, float, float], ...] = ()  # unit vectors of x, y and z
    space: str = ""  # directions of its axes in the patient, such as ``"LPS"``; or empty
    contents: tuple[Content, ...] = ()  # all volumes of a file with several
    is_labels: bool = False  # whether the file declares values as labels
    labels: tuple[Label, ...] = ()  # those that the file names or colours
    stretch: float = 1.0  # factor by which z is stretched, as units may differ
    declared_type: str = ""  # type of the voxels by the file, if they are read as a smaller one

    @property
    def label_numbers(self) -> dict[int, int] | None:
        """The file's numbers of labels by value, if they differ; None for no labels."""
        own = {each.value: each.number for each in self.labels if each.number is not None}
        return own if self.is_labels else None


Triple = tuple[float, float, float]


LARGEST_VALUE = 1e300  # of a scalar range: TFs reach beyond it, and sums compute with them
LEAST_BIN = 1e-305  # of a TF, so that squares and quotients of values are normal numbers


@dataclass(frozen=True, eq=False)
class Volume:
    """A scalar field sampled on a regular, axis-aligned grid.

    Raises :class:`VolumeError` when the array is not 3-D, has an axis shorter than two voxels, is
    not numeric or not finite, when the spacing is not positive, when all voxels are missing or the
    missing ones have another shape, or when the chosen range does not increase or holds none of the
    voxels' values.
    """

    voxels: NDArray[np.generic]
    """Finite values of any real numeric type, x fastest, native byte order, as in the file.
    Renderers interpolate them, and clamp to the scalar range afterwards. Shape (nz, ny, nx)."""
    spacing: Triple = (1.0, 1.0, 1.0)  # distance between voxel centres along x, y and z, each > 0
    origin: Triple = (0.0, 0.0, 0.0)  # position of the centre of voxel (0, 0, 0)
    name: str = "volume"  # display name, usually the file's stem
    units: str = ""  # unit of the scalars, empty when unknown
    notes: tuple[str, ...] = field(default=())  # on changes by the reader, for the user
    up: str = ""  # axis that points up, such as ``"+z"`` (a patient's head); empty if unknown
    axis_labels: tuple[str, ...] = field(default=())
    """The patient's direction (R, L, A, P, S or I) that each of :data:`~model.scene.view.AXES`
    points to; empty when unknown."""
    file: FileFacts = field(default=FileFacts())  # metadata of the volume's file
    chosen_range: Range | None = None  # a scalar range other than that of the voxels, see `over`
    missing: NDArray[np.bool_] | None = None
    """True for voxels without a measurement; None if there are none. Ranges, histograms, statistics
    and TFs ignore their finite values. They are transparent, see :attr:`hidden`, but measured ones
    are interpolated with them, so :func:`~model.scene.filling.fill` has to fill them. An array
    without True becomes None. Shape (nz, ny, nx)."""
    draws_missing: bool = False  # with the lowest measured value, see `drawing_missing`
    scale: ValueScale = "linear"
    """"log" if the voxels are the logarithms of those of `linear`, see :meth:`on_scale`. Voxels and
    ranges are then on that scale."""
    stored: Volume | None = None  # the linear volume of one whose scale is "log"

    def __post_init__(self) -> None:
        voxels = self.voxels
        if voxels.ndim != 3 or min(voxels.shape) < 2:
            raise VolumeError(
                f"{self.name}: an array of shape {voxels.shape} is not a volume; "
                "three axes of at least two voxels each are needed."
            )
        if voxels.dtype.kind not in "iuf":
            raise VolumeError(
                f"{self.name}: voxels of type {voxels.dtype} are not real numbers; "
                "convert the file to an integer or floating-point type."
            )
        if not all(np.isfinite(s) and s > 0 for s in self.spacing):
            raise VolumeError(
                f"{self.name}: the spacing {self.spacing} must be positive along every axis; "
                "correct it in the file's header."
            )
        if self.missing is not None:
            self._check_missing(self.missing)
        lo, hi = self.data_range
        if not (np.isfinite(lo) and np.isfinite(hi)):
            raise VolumeError(f"{self.name}: the volume holds NaN or infinite voxels.")
        if not np.isfinite(hi - lo):
            raise VolumeError(
                f"{self.name}: the values from {lo:g} to {hi:g} span more than a floating-point "
                "number can hold; scale them down."
            )
        # A mask in a file may have one value.
        is_mask = self.distribution.is_constant and self.stored is None
        if not (is_mask or is_resolved((lo, hi))):
            raise VolumeError(
                f"{self.name}: the values from {lo:.17g} to {hi:.17g} are too close to one another "
                "for floating-point numbers to tell them apart; subtract an offset from them, or "
                "scale them up."
            )
        if self.chosen_range is not None:
            self._check_overlap(self.chosen_range)

    def over(self, scalar_range: Range, scale: ValueScale | None = None) -> Volume:
        """Return the same volume over another scalar range, and on another scale on demand.

        TFs then have that range; values beyond it look like those at its ends. Voxels and derived
        quantities, such as the fingerprint, are shared. Raises :class:`VolumeError` if the range
        does not increase or contains no voxel's value.
        """
        if scale is not None and scale != self.scale:
            return self.on_scale(scale).over(scalar_range)
        lo, hi = (float(value) for value in scalar_range)
        self._check_overlap((lo, hi))
        volume = copy.copy(self)
        chosen = None if (lo, hi) == self.data_range else (lo, hi)
        object.__setattr__(volume, "chosen_range", chosen)
        return volume

    @property
    def linear(self) -> Volume:
        """The volume on the linear scale, with the file's values."""
        return self.stored or self

    def on_scale(self, scale: ValueScale) -> Volume:
        """Return the same volume on another scale, over the range of all its voxels.

        On a logarithmic one the voxels are decimal logarithms as floats. Values of at most zero
        look like the smallest positive voxel, at the range's start. Raises :class:`VolumeError` if
        fewer than two values have a logarithm.
        """
        if scale == self.scale:
            return self
        stored = self.linear
        if scale == "linear":
            return stored.drawing_missing(self.draws_missing)
        voxels = logarithms(stored.voxels, stored.distribution)
        if voxels is None:
            raise VolumeError(
                f"{self.name}: no value is above zero, so there is no logarithm to show; "
                "keep the linear scale."
            )
        if stored.missing is not None:
            # The mean of logarithms, as the logarithm of a mean is that of the largest values.
            fill(voxels, stored.missing)
        try:
            return replace(
                stored,
                voxels=voxels,
                chosen_range=None,
                draws_missing=self.draws_missing,
                scale=scale,
                stored=stored,
            )
        except VolumeError:
            raise VolumeError(
                f"{self.name}: the values above zero are too few or too close to one another for "
                "a logarithmic scale; keep the linear one."
            ) from None

    def drawing_missing(self, drawn: bool) -> Volume:
        """Return the volume with missing voxels drawn with the lowest measured value, or not."""
        volume = copy.copy(self)
        object.__setattr__(volume, "draws_missing", drawn)
        vars(volume).pop("_lowered", None)
        return volume

    @property
    def hidden(self) -> NDArray[np.bool_] | None:
        """Voxels that are transparent under any TF, like :attr:`missing`; None without any."""
        return None if self.draws_missing else self.missing

    @property
    def shown(self) -> NDArray[np.generic]:
        """Voxels as they are drawn."""
        return self._lowered if self.draws_missing else self.voxels

    @cached_property
    def _lowered(self) -> NDArray[np.generic]:
        return self._with_lowest(slice(None))

    def _with_lowest(self, planes: slice) -> NDArray[np.generic]:
        """Return planes, with the lowest measured value for missing voxels."""
        voxels: NDArray[np.generic] = self.voxels[planes]
        if self.missing is None:
            return voxels
        return np.where(self.missing[planes], self.distribution.ends[0], voxels)

    @cached_property
    def missing_share(self) -> float:
        """Fraction of the voxels that is missing, 0 to below 1."""
        return 0.0 if self.missing is None else float(self.missing.mean())

    @property
    def missing_text(self) -> str:
        """The share of missing voxels and whether they are drawn, in words; "" without any."""
        if self.missing is None:
            return ""
        share = max(100 * self.missing_share, 0.01)
        drawn = "drawn with the lowest value" if self.draws_missing else "not drawn"
        return f"Missing voxels ({share:.2g} %) are {drawn}."

    @property
    def data_range(self) -> Range:
        """Smallest and largest measured voxel, on the volume's scale."""
        return self.distribution.range

    @property
    def scalar_range(self) -> Range:
        """Range of TFs: that of the voxels, or another one, see :meth:`over`."""
        return self.chosen_range or self.data_range

    @property
    def dimensions(self) -> tuple[int, int, int]:
        """Number of voxels along x, y and z."""
        nz, ny, nx = self.voxels.shape
        return nx, ny, nz

    @property
    def extent(self) -> Triple:
        """Distance between the first and the last voxel centre along x, y and z."""
        x, y, z = ((n - 1) * step for n, step in zip(self.dimensions, self.spacing, strict=True))
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
        """Geometric mean of the spacing: unit of sample distances and of a TF's opacities."""
        return math.prod(self.spacing) ** (1 / 3)

    @property
    def has_thick_slices(self) -> bool:
        """Whether what is thin and oblique looks like ropes of beads, a bead for each slice."""
        return max(self.spacing) >= THICK * min(self.spacing)

    @cached_property
    def distribution(self) -> Distribution:
        """Distribution of the measured voxels over scalar values."""
        return Distribution(self.voxels, self.missing)

    def histogram(
        self, bins: int = 256, beyond: bool = False
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Count measured voxels per bin of scalar values.

        The range has at most `bins` equal bins; fewer for whole numbers, so that all bins hold
        equally many of them. With `beyond`, there are at most as many on each side of the range.
        Returns counts (n,) and edges (n + 1,), in the data's units.
        """
        edges = self.distribution.edges(self.scalar_range, bins, beyond)
        return self.distribution.histogram(edges), edges

    def _check_missing(self, missing: NDArray[np.bool_]) -> None:
        if missing.shape != self.voxels.shape or missing.dtype != np.bool_:
            raise VolumeError(
                f"{self.name}: the mask of missing voxels has shape {missing.shape} and type "
                f"{missing.dtype}; it must be of booleans and have shape {self.voxels.shape}."
            )
        if missing.all():
            raise VolumeError(
                f"{self.name}: every voxel is missing, so there is nothing to show; "
                "choose another file or component."
            )
        if not missing.any():
            object.__setattr__(self, "missing", None)
        elif self.voxels.dtype.kind == "f" and not all(
            np.isfinite(plane).all() for plane in self.voxels
        ):
            raise VolumeError(f"{self.name}: the volume holds NaN or infinite voxels.")

    def _check_overlap(self, scalar_range: Range) -> None:
        lo, hi = scalar_range
        lowest, highest = self.data_range
        ends = [value_at(place, self.scale) for place in (lo, hi, lowest, highest)]
        if not (math.isfinite(hi - lo) and lo < hi):
            raise VolumeError(
                f"{self.name}: the scalar range [{ends[0]:g}, {ends[1]:g}] is not increasing; "
                "give [lowest, highest]."
            )
        if max(abs(lo), abs(hi)) > LARGEST_VALUE:
            raise VolumeError(
                f"{self.name}: the scalar range [{ends[0]:g}, {ends[1]:g}] reaches values too "
                f"large to compute with; stay within {LARGEST_VALUE:g}, or scale the values down."
            )
        if not is_resolved(scalar_range):
            raise VolumeError(
                f"{self.name}: the scalar range [{ends[0]:.17g}, {ends[1]:.17g}] is too narrow for "
                "floating-point numbers; give a wider one."
            )
        if hi <= lowest or highest <= lo:
            raise VolumeError(
                f"{self.name}: the scalar range [{ends[0]:g}, {ends[1]:g}] has no value in common "
                f"with the voxels, which lie from {ends[2]:g} to {ends[3]:g}; choose one that has."
            )

    @property
    def series(self) -> tuple[object, ...]:
        """Properties that the time steps of a simulation or scan share, for comparison."""
        return self.dimensions, re.sub(r"[\d\W_]+", "", self.name)

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of the voxels, their type in the file, shape, spacing and which are missing."""
        if self.stored is not None:
            return self.stored.fingerprint
        digest = hashlib.sha256()
        little = np.dtype(self.file.declared_type or self.voxels.dtype).newbyteorder("<")
        spacing = [float(s) for s in self.spacing]
        digest.update(f"{little.str} {self.dimensions} {spacing}".encode())
        for z in range(len(self.voxels)):
            plane = self._with_lowest(slice(z, z + 1)).astype(little, copy=False)
            digest.update(np.ascontiguousarray(plane).data)
        if self.missing is not None:
            digest.update(np.packbits(self.missing).data)
        return digest.hexdigest()


def is_resolved(scalar_range: Range) -> bool:
    """Return True if a TF's 256 bins over a range are distinct floating-point numbers.

    They are not if the range is narrow and far from 0, or close to the smallest numbers.
    """
    lo, hi = scalar_range
    bin_width = (hi - lo) / 256
    return bin_width > LEAST_BIN and bin_width > 16 * np.spacing(max(abs(lo), abs(hi)))
