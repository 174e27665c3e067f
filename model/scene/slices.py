"""Slices of a volume: their orientation, their colours, and positions of voxels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from model.scene.clip_plane import ClipPlane, ShownPart
from model.scene.crop import place_of, voxel_at
from model.scene.mask import Mask
from model.scene.transfer_function import TF_SAMPLES, Range, TransferFunction
from model.scene.view import AXES, axis_labelled, upright_frame
from model.scene.volume import Triple, Volume

SliceColors = Literal["gray", "colors", "overlay"]  # gray, the TF's colours, or these over gray

MIDDLE: Triple = (0.5, 0.5, 0.5)
STEPS = 16  # colours per bin of a TF: a label has exactly its bin's
NARROWEST = 1e-4  # limits of the grey window's width, relative to the scalar range
SATURATED = 0.002  # share of the voxels at either end that the default grey window omits
NAMES = {"S": "Axial", "I": "Axial", "A": "Coronal", "P": "Coronal", "L": "Sagittal"}
OPPOSITES = dict(zip("LRAPSI", "RLPAIS", strict=True))


@dataclass(frozen=True)
class Plane:
    """The slices across one axis of a volume, and their orientation in the picture.

    Axes are 0, 1 or 2 for x, y or z. `right` and `up` are axes with a sign: 1 if the axis grows to
    the right or upwards in the picture, else -1. Places are fractions of the volume's extent along
    x, y and z, or of the picture from its upper left.
    """

    axis: int
    right: tuple[int, int]
    up: tuple[int, int]
    name: str  # Axial, Coronal or Sagittal, else the axis
    edges: tuple[str, str, str, str]  # directions at the left, right, lower and upper edge

    def cut(self, grid: NDArray[Any], place: Triple) -> NDArray[Any]:
        """Return the slice of a grid (nz, ny, nx) at a place, without a copy; row 0 is the top."""
        index = voxel_at(place[self.axis], grid.shape[2 - self.axis])
        picture = np.moveaxis(grid, 2 - self.axis, 0)[index]
        if self.up[0] < self.right[0]:
            picture = picture.T
        return picture[:: -self.up[1], :: self.right[1]]

    def in_picture(self, place: Triple) -> tuple[float, float]:
        """Return a place's position in the picture."""
        (right, r), (up, u) = self.right, self.up
        x, y = place[right], place[up]
        return (x if r > 0 else 1 - x), (y if u < 0 else 1 - y)

    def moved(self, place: Triple, at: tuple[float, float]) -> Triple:
        """Return the nearest place of the same slice for a position in the picture."""
        (right, r), (up, u) = self.right, self.up
        x, y = (min(max(share, 0.0), 1.0) for share in at)
        found = {self.axis: place[self.axis], right: x if r > 0 else 1 - x}
        found[up] = y if u < 0 else 1 - y
        return found[0], found[1], found[2]


@lru_cache(maxsize=8)
def planes_of(up: str, labels: tuple[str, ...] = ()) -> tuple[Plane, Plane, Plane]:
    """Return the three planes of a volume: horizontal first, then from the front and the side.

    `up` is the axis that points up; `labels` has the patient's directions of
    :data:`model.scene.view.AXES`, if known. Patients are shown as in radiology: from the feet, with
    their right side on the left, and with the face to the left.
    """
    frame = upright_frame(up, axis_labelled("A", labels))
    names = labels or tuple(axis.replace("-", "−") for axis in AXES)
    x, y, z = ((k := int(np.argmax(np.abs(row))), 1 if row[k] > 0 else -1) for row in frame)

    def plane(axis: int, right: tuple[int, int], up: tuple[int, int]) -> Plane:
        (left, to_right), (bottom, top) = (
            names[2 * k : 2 * k + 2][::-sign] for k, sign in (right, up)
        )
        name = NAMES.get(labels[2 * axis], "Sagittal") if labels else "xyz"[axis]
        return Plane(axis, right, up, name, (left, to_right, bottom, top))

    return plane(z[0], x, (y[0], -y[1])), plane(y[0], x, z), plane(x[0], y, z)


def voxel_of(volume: Volume, place: Triple) -> tuple[int, int, int]:
    """Return the voxel along x, y and z that is nearest to a place."""
    x, y, z = (voxel_at(p, n) for p, n in zip(place, volume.dimensions, strict=True))
    return x, y, z


def place_at(volume: Volume, voxel: tuple[int, int, int]) -> Triple:
    """Return the place of a voxel's center, or of the nearest existing voxel."""
    counts = volume.dimensions
    x, y, z = (place_of(min(max(v, 0), n - 1), n) for v, n in zip(voxel, counts, strict=True))
    return x, y, z


def stored_at(volume: Volume, place: Triple) -> float | None:
    """Return the file's value of the voxel at a place; None if it is missing."""
    x, y, z = voxel_of(volume, place)
    if volume.missing is not None and volume.missing[z, y, x]:
        return volume.linear.data_range[0] if volume.draws_missing else None
    return float(volume.linear.voxels[z, y, x])


def cut_away(
    volume: Volume, plane: Plane, place: Triple, mask: Mask | None, clip: ClipPlane | None
) -> NDArray[np.bool_] | None:
    """Return the voxels of a slice (h, w) hidden by a mask or a clipping plane, or None."""
    if mask is None and clip is None:
        return None
    shape = volume.voxels.shape
    numbers = np.ogrid[tuple(map(slice, np.array(shape, np.int32)))]
    x, y, z = (plane.cut(np.broadcast_to(each, shape), place) for each in numbers[::-1])
    hidden = np.zeros(x.shape, bool)
    if mask is not None and mask.shape == shape:
        hidden |= ~mask.shows(x, y, z)
    if clip is not None:
        *normal, level = ShownPart(clip=clip).plane(volume).astype(np.float32)
        hidden |= sum(share * each for share, each in zip(normal, (x, y, z), strict=True)) > level
    return hidden


def coordinates(volume: Volume, place: Triple) -> list[tuple[str, float]]:
    """Return the position of the voxel at a place in the file's space and unit, by axis.

    Axes of a patient have the letter of the voxel's side; others are x, y and z. Without any
    spacing there is none: it would be the voxel's number.
    """
    if volume.spacing == (1, 1, 1) and not (volume.file.spacing_unit or any(volume.origin)):
        return []
    axes = np.array(volume.file.directions or np.eye(3))
    steps = np.array(voxel_of(volume, place)) * volume.spacing
    numbers = (np.array(volume.origin) + steps @ axes).tolist()
    space = volume.file.space
    if not (len(space) == 3 and OPPOSITES.keys() >= set(space)):
        return list(zip("xyz", numbers, strict=True))
    letters = ((letter, OPPOSITES[letter]) for letter in space)
    return [(pair[n < 0], abs(n)) for pair, n in zip(letters, numbers, strict=True)]


@dataclass(frozen=True, eq=False)
class SlicePaint:
    """Colours of values: RGBA, uint8 (n, 4), at even steps from the lowest to the highest."""

    values: Range
    table: NDArray[np.uint8]

    @classmethod
    @lru_cache(maxsize=4)
    def of(cls, window: Range, tf: TransferFunction | None, is_overlay: bool = False) -> SlicePaint:
        """Return the colours of a grey window, of a TF, or of a TF over grey."""
        count = 256 if tf is None else STEPS * (TF_SAMPLES - 1) + 1
        values = window if tf is None else tf.scalar_range
        gray = (np.linspace(*values, count) - window[0]) / (window[1] - window[0])
        rgb = np.clip(gray, 0, 1)[:, None].repeat(3, axis=1)
        if tf is not None:
            opacity = tf.opacity.sample(count=count)[:, None] if is_overlay else 1.0
            rgb += opacity * (tf.color.sample(count=count) - rgb)
        levels = np.rint(255 * np.clip(np.column_stack([rgb, np.ones(count)]), 0, 1))
        return cls(values, levels.astype(np.uint8))

    def picture(
        self,
        values: NDArray[Any],
        missing: NDArray[np.bool_] | None = None,
        outlined: Range | None = None,
        ink: int = 0xFFFFFF,
    ) -> NDArray[np.uint8]:
        """Colour values (h, w) as RGBA (h, w, 4): missing ones clear, a band's edge in 0xRRGGBB."""
        low, high = self.values
        last = len(self.table) - 1
        levels = np.subtract(values, low, dtype=np.float64)
        levels *= last / (high - low)
        levels += 0.5
        np.clip(levels, 0, last, out=levels)
        colors = self.table.view(np.uint32)[:, 0][levels.astype(np.uint16, order="C")]
        if outlined is not None:
            lowest, highest = outlined
            if values.dtype.kind != "f":
                # Whole numbers are compared as such, which is many times faster.
                lowest, highest = math.ceil(lowest), math.floor(highest)
            inside = (values >= lowest) & (values <= highest)
            if missing is not None:
                inside &= ~missing
            drawn = np.frombuffer(ink.to_bytes(3, "big") + b"\xff", np.uint32)
            np.putmask(colors, _edge(inside), drawn)
        if missing is not None:
            colors[missing] = 0
        return colors.view(np.uint8).reshape(*values.shape, 4)


def usual_window(counts: NDArray[np.integer], edges: NDArray[np.floating]) -> Range:
    """Return the grey window of nearly all voxels, by a histogram (n,) and its edges."""
    upto = np.cumsum(counts) / counts.sum()
    first = int(np.searchsorted(upto, SATURATED, side="right"))
    last = max(int(np.searchsorted(upto, 1 - SATURATED)), first)
    return float(edges[first]), float(edges[last + 1])


def gray_window(window: Range, scalar_range: Range, wider: float, higher: float) -> Range:
    """Return a grey window widened by a factor, and moved by a share of its width."""
    lo, hi = scalar_range
    width = min(max((window[1] - window[0]) * wider, NARROWEST * (hi - lo)), 4 * (hi - lo))
    middle = min(max(sum(window) / 2 + higher * width, lo), hi)
    return middle - width / 2, middle + width / 2


def _edge(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Inside pixels with a neighbour outside."""
    inner = inside.copy()
    inner[1:] &= inside[:-1]
    inner[:-1] &= inside[1:]
    inner[:, 1:] &= inside[:, :-1]
    inner[:, :-1] &= inside[:, 1:]
    return inside & ~inner
