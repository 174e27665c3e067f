"""Slices of a volume: how they lie in their pictures, their colours, and where a voxel is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from model.scene.crop import place_of, voxel_at
from model.scene.transfer_function import TF_SAMPLES, Range, TransferFunction
from model.scene.view import axis_labelled, upright_frame
from model.scene.volume import Triple, Volume

SliceColors = Literal["gray", "colors", "overlay"]  # gray, the colour TF, or both by opacity

MIDDLE: Triple = (0.5, 0.5, 0.5)
STEPS = 16  # colours from one of a TF's bins to the next: a label has its own bin's exactly
NARROWEST = 1e-4  # width of a window of gray, by the scalar range
NAMES = {"S": "Axial", "I": "Axial", "A": "Coronal", "P": "Coronal", "L": "Sagittal"}


@dataclass(frozen=True)
class Plane:
    """The slices across one axis of a volume, and how they lie in their picture.

    Each axis is 0, 1 or 2 for x, y or z. `right` and `up` are axes with a sign: 1 where the axis
    grows to the right or upwards in the picture, else -1.
    """

    axis: int
    right: tuple[int, int]
    up: tuple[int, int]
    name: str  # Axial, Coronal or Sagittal, else the axis across
    edges: tuple[str, str, str, str]  # directions at the left, right, lower and upper edge

    def cut(self, grid: NDArray[Any], place: Triple) -> NDArray[Any]:
        """Return the slice of a grid (nz, ny, nx) at a place, without a copy; row 0 is the top."""
        index = voxel_at(place[self.axis], grid.shape[2 - self.axis])
        picture = np.moveaxis(grid, 2 - self.axis, 0)[index]
        if self.up[0] < self.right[0]:
            picture = picture.T
        return picture[:: -self.up[1], :: self.right[1]]

    def in_picture(self, place: Triple) -> tuple[float, float]:
        """Return a place's fractions of the picture, from the left and from the top."""
        (right, r), (up, u) = self.right, self.up
        return (
            place[right] if r > 0 else 1 - place[right],
            place[up] if u < 0 else 1 - place[up],
        )

    def moved(self, place: Triple, at: tuple[float, float]) -> Triple:
        """Return a place of the same slice at fractions of the picture, within the volume."""
        found = list(place)
        (right, r), (up, u) = self.right, self.up
        for axis, is_along, share in ((right, r > 0, at[0]), (up, u < 0, at[1])):
            found[axis] = min(max(share if is_along else 1 - share, 0.0), 1.0)
        return (found[0], found[1], found[2])


def planes_of(up: str, labels: tuple[str, ...] = ()) -> tuple[Plane, Plane, Plane]:
    """Return the three planes of a volume: level ones first, then from the front and the side.

    `up` is the axis that points up, `labels` has the patient's direction of each of
    :data:`model.scene.view.AXES`, if known. Patients are seen as radiologists see them: from the
    feet, with their right side on the left, and with the face to the left.
    """
    frame = upright_frame(up, axis_labelled("A", labels))
    (x, y, z), names = (_signed(row) for row in frame), labels or _AXIS_NAMES

    def plane(across: tuple[int, int], right: tuple[int, int], up: tuple[int, int]) -> Plane:
        letters = [names[2 * axis + (sign < 0)] for axis, sign in (right, up)]
        others = [names[2 * axis + (sign > 0)] for axis, sign in (right, up)]
        name = NAMES.get(labels[2 * across[0]], "Sagittal") if labels else "xyz"[across[0]]
        return Plane(across[0], right, up, name, (others[0], letters[0], others[1], letters[1]))

    return plane(z, x, (y[0], -y[1])), plane(y, x, z), plane(x, y, z)


_AXIS_NAMES = ("+x", "−x", "+y", "−y", "+z", "−z")


def _signed(row: NDArray[np.float64]) -> tuple[int, int]:
    axis = int(np.argmax(np.abs(row)))
    return axis, 1 if row[axis] > 0 else -1


def voxel_of(volume: Volume, place: Triple) -> tuple[int, int, int]:
    """Return the nearest voxel along x, y and z to a place in fractions of the extent."""
    x, y, z = (voxel_at(p, n) for p, n in zip(place, volume.dimensions, strict=True))
    return x, y, z


def place_at(volume: Volume, voxel: tuple[int, int, int]) -> Triple:
    """Return the place of a voxel's center, in fractions of the extent, within the volume."""
    x, y, z = (
        place_of(min(max(v, 0), n - 1), n) for v, n in zip(voxel, volume.dimensions, strict=True)
    )
    return x, y, z


def stored_at(volume: Volume, place: Triple) -> float | None:
    """Return the file's value of the voxel at a place; None where nothing was measured."""
    x, y, z = voxel_of(volume, place)
    if volume.missing is not None and volume.missing[z, y, x] and not volume.draws_missing:
        return None
    return float(volume.linear.voxels[z, y, x])


def coordinates(volume: Volume, place: Triple) -> list[tuple[str, float]]:
    """Return where the voxel at a place lies in the file's space and unit, by axis.

    Axes of a patient have the letter of the side that the voxel lies on, others are x, y and z.
    """
    axes = np.array(volume.file.directions) if volume.file.directions else np.eye(3)
    steps = np.array(voxel_of(volume, place)) * volume.spacing
    numbers = (np.array(volume.origin) + steps @ axes).tolist()
    space = volume.file.space
    if len(space) != 3:
        return list(zip("xyz", numbers, strict=True))
    return [
        (letter if number >= 0 else _OPPOSITE.get(letter, f"−{letter}"), abs(number))
        for letter, number in zip(space, numbers, strict=True)
    ]


_OPPOSITE = dict(zip("LRAPSI", "RLPAIS", strict=True))


@dataclass(frozen=True, eq=False)
class SlicePaint:
    """Colours of values: uint8 (n, 4) at even steps from the lowest to the highest."""

    values: Range
    table: NDArray[np.uint8]

    @classmethod
    def of(cls, colors: SliceColors, window: Range, tf: TransferFunction) -> SlicePaint:
        """Return the colours of a window of gray, of a TF, or of the TF over the gray."""
        if colors == "gray":
            levels = np.arange(256, dtype=np.uint8)
            return cls(window, np.stack([levels] * 3 + [np.full(256, 255, np.uint8)], axis=1))
        count = STEPS * (TF_SAMPLES - 1) + 1
        rgb = tf.color.sample(count=count).astype(np.float64)
        if colors == "overlay":
            low, high = window
            values = np.linspace(*tf.scalar_range, count)
            gray = np.clip((values - low) / (high - low), 0, 1)[:, None]
            opacity = tf.opacity.sample(count=count)[:, None]
            rgb = gray + opacity * (rgb - gray)
        levels = np.rint(255 * np.clip(np.column_stack([rgb, np.ones(count)]), 0, 1))
        return cls(tf.scalar_range, levels.astype(np.uint8))

    def picture(
        self,
        values: NDArray[Any],
        missing: NDArray[np.bool_] | None = None,
        band: Range | None = None,
        ink: int = 0xFFFFFF,
    ) -> NDArray[np.uint8]:
        """Colour values (h, w), RGBA (h, w, 4); missing ones are clear.

        A band of values is outlined in an ink 0xRRGGBB.
        """
        low, high = self.values
        last = len(self.table) - 1
        levels = np.subtract(values, low, dtype=np.float64)
        levels *= last / (high - low)
        levels += 0.5
        np.clip(levels, 0, last, out=levels)
        colors = self.table.view(np.uint32)[:, 0][levels.astype(np.uint16)]
        if band is not None:
            # Whole numbers are compared as such, which is many times as fast.
            lowest, highest = band if values.dtype.kind == "f" else _whole(band)
            inside = (values >= lowest) & (values <= highest)
            if missing is not None:
                inside &= ~missing
            drawn = np.array([ink >> 16 & 255, ink >> 8 & 255, ink & 255, 255], np.uint8)
            np.putmask(colors, _edge(inside), drawn.view(np.uint32))
        if missing is not None:
            colors[missing] = 0
        return colors.view(np.uint8).reshape(*values.shape, 4)


def _whole(band: Range) -> tuple[int, int]:
    return math.ceil(band[0]), math.floor(band[1])


SATURATED = 0.002  # share of the voxels at either end that the usual window of gray leaves out


def usual_window(counts: NDArray[np.integer], edges: NDArray[np.floating]) -> Range:
    """Return the window of gray of nearly all voxels, by a histogram (n,) and its edges."""
    upto = np.cumsum(counts) / counts.sum()
    first = int(np.searchsorted(upto, SATURATED, side="right"))
    last = max(int(np.searchsorted(upto, 1 - SATURATED)), first)
    return float(edges[first]), float(edges[last + 1])


def gray_window(window: Range, scalar_range: Range, wider: float, higher: float) -> Range:
    """Return a window of gray made wider by a factor, and moved by a part of its width."""
    whole = scalar_range[1] - scalar_range[0]
    width = min(max((window[1] - window[0]) * wider, NARROWEST * whole), 4 * whole)
    middle = (window[0] + window[1]) / 2 + higher * width
    middle = min(max(middle, scalar_range[0]), scalar_range[1])
    return middle - width / 2, middle + width / 2


def _edge(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels inside that have a neighbour outside."""
    inner = inside.copy()
    inner[1:] &= inside[:-1]
    inner[:-1] &= inside[1:]
    inner[:, 1:] &= inside[:, :-1]
    inner[:, :-1] &= inside[:, 1:]
    return inside & ~inner
