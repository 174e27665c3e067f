"""The pixels of an image, or of a part of it, and images of more or fewer pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from model.scene.region import Reach
from model.scene.view import VIEW_ANGLE, View
from model.scene.volume import Volume

TIME_GROWTH = 0.83
"""Exponent of a picture's time by its number of pixels: neighbours share cached voxels. For four of
five of the ray caster's pictures of 256 to 1024 columns it is .82 to .98."""

LARGE, LARGER = 2.5, 3.5  # pixels of a voxel from which on normals are blurred, and fully so
BLUR = 1 / 3  # of large voxels: share of each of three in a difference across it, as Prewitt's

_Number = TypeVar("_Number", bound=np.generic)


@dataclass(frozen=True)
class Raster:
    """A picture's pixels, or a rectangle of them.

    The picture's shorter side spans the view's angle: a wider or higher picture contains the square
    one, and shows more on both sides. Parts rendered separately fit together exactly.
    """

    width: int  # the whole picture, in pixels
    height: int
    left: int = 0  # first pixel of the part
    top: int = 0
    columns: int = 0
    rows: int = 0  # size of the part; 0 for all pixels right of and below its first one
    step: int = 1  # step between the part's pixels along both sides

    def __post_init__(self) -> None:
        if not self.columns:
            object.__setattr__(self, "columns", self.width - self.left)
        if not self.rows:
            object.__setattr__(self, "rows", self.height - self.top)

    @classmethod
    def of(cls, size: int | Raster) -> Raster:
        """Return the raster of a square image, given its size; rasters stay as they are."""
        return size if isinstance(size, Raster) else cls(size, size)

    @property
    def reach(self) -> Reach:
        """The whole picture's reach, see :data:`model.scene.region.Reach`."""
        return self.width / self.shorter / 2, self.height / self.shorter / 2

    @property
    def side(self) -> float:
        """Side of a square with as many pixels as the whole picture."""
        return float((self.width * self.height) ** 0.5)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the part."""
        return self.rows, self.columns

    @property
    def right(self) -> int:
        """Column after the last one."""
        return self.left + self.columns

    @property
    def bottom(self) -> int:
        """Row after the last one."""
        return self.top + self.rows

    @property
    def center(self) -> tuple[float, float]:
        """Middle of the part, right of and above the picture's, in halves of its shorter side."""
        right = 2 * self.left + 1 + self.step * (self.columns - 1) - self.width
        down = 2 * self.top + 1 + self.step * (self.rows - 1) - self.height
        return right / self.shorter, -down / self.shorter

    @property
    def half_size(self) -> tuple[float, float]:
        """Half the part's width and height, in halves of the picture's shorter side."""
        scale = self.step / self.shorter
        return self.columns * scale, self.rows * scale

    @property
    def shorter(self) -> int:
        """Shorter side of the picture in pixels: the size of the square in its middle."""
        return min(self.width, self.height)

    def scaled(self, scale: float) -> Raster:
        """Return the whole picture with more or fewer pixels, at least 16 along each side."""
        sides = (max(round(side * scale), 16) for side in (self.width, self.height))
        return Raster(*sides)

    def tiles(self, columns: int, rows: int) -> Iterator[Raster]:
        """Divide the part into tiles of at most this size, row by row."""
        for top in range(self.top, self.bottom, rows):
            for left in range(self.left, self.right, columns):
                size = min(columns, self.right - left), min(rows, self.bottom - top)
                yield Raster(self.width, self.height, left, top, *size)

    def every_second(self, row: int, column: int) -> Raster:
        """Return every second pixel of every second row, from one of the first four."""
        size = (self.columns - column + 1) // 2, (self.rows - row + 1) // 2
        return Raster(self.width, self.height, self.left + column, self.top + row, *size, step=2)

    def grown(self, margin: int) -> Raster:
        """Return the part with a margin, within the whole picture."""
        left, top = max(self.left - margin, 0), max(self.top - margin, 0)
        right, bottom = min(self.right + margin, self.width), min(self.bottom + margin, self.height)
        return replace(self, left=left, top=top, columns=right - left, rows=bottom - top)


def middle_square(image: NDArray[_Number]) -> NDArray[_Number]:
    """Return the middle square of an image (H, W, ...), which images of all shapes share."""
    height, width = image.shape[:2]
    side = min(height, width)
    top, left = (height - side) // 2, (width - side) // 2
    return image[top : top + side, left : left + side]


def resized(
    image: NDArray[np.float32], shape: tuple[int, ...], wanted: Sequence[NDArray[np.intp]] = ()
) -> NDArray[np.float32]:
    """Interpolate an image (h, w, channels) to another size; `wanted` rows and columns, or all."""
    for axis, (want, chosen) in enumerate(zip(shape, wanted or map(np.arange, shape), strict=True)):
        have = image.shape[axis]
        if have == want == len(chosen):
            continue
        last = have - 1
        at = np.clip((chosen + 0.5) * have / want - 0.5, 0, last)
        before = np.minimum(at.astype(np.intp), max(last - 1, 0))
        part = (at - before).astype(np.float32)
        part = part.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        after = np.minimum(before + 1, last)
        image = np.take(image, before, axis) * (1 - part) + np.take(image, after, axis) * part
    return image


ROWS = 16  # of an image that fit into a processor's cache together


def fill_white_squares(image: NDArray[np.float32]) -> None:
    """Interpolate the white squares of a chessboard pattern in an image (H, W, 4).

    Pixel (0, 0) is black. White ones are means of the two neighbours whose green differs less.
    """
    around = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="reflect")
    # Pixels that are copied as wholes take a third of the time.
    pixels, around = (each.view("V16")[..., 0] for each in (image, around))
    for top in range(0, len(image), ROWS):
        for row, column in ((0, 1), (1, 0)):
            white, near = pixels[top : top + ROWS][row::2, column::2], around[top + row :, column:]
            found = [
                near[down::2, right::2][: white.shape[0], : white.shape[1]].copy()
                for down, right in ((0, 1), (2, 1), (1, 0), (1, 2))
            ]
            above, below, left, right = (
                each.view(np.float32).reshape(*each.shape, 4) for each in found
            )
            upright = np.abs(above[..., 1] - below[..., 1]) < np.abs(left[..., 1] - right[..., 1])
            np.copyto(found[2], found[0], where=upright)
            np.copyto(found[3], found[1], where=upright)
            white[...] = (0.5 * (left + right)).view("V16")[..., 0]


def at_size_of(
    field: NDArray[np.float32], image: NDArray[np.float32], sampled: bool = False
) -> NDArray[np.float32]:
    """Return an image (h, w, 3) with as many pixels as a field of it or of its square.

    Pixels are means over their areas or, if `sampled`, the image's values at their centres.
    """
    if field.shape == image.shape:
        return image
    # Imported here to keep the window's start fast.
    from skimage.transform import resize

    rows, columns, _ = field.shape
    shown = middle_square(image) if rows == columns else image
    order = 3 if sampled else 1
    resized = resize(shown, field.shape, order=order, anti_aliasing=not sampled)
    return np.asarray(resized, dtype=np.float32)


def blur_of(view: View, volume: Volume, raster: Raster, size: float | None = None) -> float:
    """Return the share of each of two neighbours in a difference of voxels: 0 to :data:`BLUR`.

    A voxel counts by its longest side, as thick slices show their steps, or by a given size.
    """
    half = view.camera_distance(volume.radius) * math.tan(math.radians(VIEW_ANGLE / 2))
    pixels = (size or max(volume.spacing)) * raster.shorter / 2 / half
    return min(max((pixels - LARGE) / (LARGER - LARGE), 0.0), 1.0) * BLUR
