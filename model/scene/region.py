"""Image regions, over which sensitivities are computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError

Mask = NDArray[np.bool_]  # pixels of a region: shape (rows, columns), row 0 at the top
Shape = int | tuple[int, int]  # of a square image, or rows and columns of another
Reach = tuple[float, float]  # half an image's width and height, in sides of its middle square
SQUARE: Reach = (0.5, 0.5)  # reach of a square image
EDGE = 0.01  # how far an outline must reach into the image, as a share of its side


@dataclass(frozen=True)
class Region:
    """Rectangle of pixels; left and top are inclusive, right and bottom exclusive."""

    left: int
    top: int
    right: int
    bottom: int

    @classmethod
    def parse(cls, text: str) -> Region:
        """Parse ``"LEFT,TOP,RIGHT,BOTTOM"`` in pixels; raise :class:`RenderError` for others."""
        try:
            return cls(*(int(part) for part in text.split(",")))
        except (ValueError, TypeError):
            raise RenderError(
                f"'{text}' is not a region; give left,top,right,bottom in pixels from the upper "
                "left corner, such as 100,80,140,120."
            ) from None

    @classmethod
    def whole(cls, size: int) -> Region:
        """Return the region of a whole image."""
        return cls(0, 0, size, size)

    def mask(self, shape: Shape) -> Mask:
        """Return the region's pixels in an image of this shape, which must contain it."""
        rows, columns = _rows_and_columns(shape)
        if not (0 <= self.left < self.right <= columns and 0 <= self.top < self.bottom <= rows):
            raise RenderError(
                f"The region from ({self.left}, {self.top}) to ({self.right}, {self.bottom}) is "
                f"empty or outside the image of {columns} x {rows} pixels; choose one inside."
            )
        mask = np.zeros((rows, columns), dtype=bool)
        mask[self.top : self.bottom, self.left : self.right] = True
        return mask


@dataclass(frozen=True)
class Outline:
    """Polygon in an image of any size, such as a rectangle or a lasso."""

    points: tuple[tuple[float, float], ...] = ()
    """Corners in order, to the right and down, as fractions of the image's middle square; they may
    be outside it, and outside the image. Without points it is the whole image."""

    @classmethod
    def rectangle(cls, left: float, top: float, right: float, bottom: float) -> Outline:
        """Return the outline of a rectangle."""
        return cls(((left, top), (right, top), (right, bottom), (left, bottom)))

    def moved(self, dx: float, dy: float) -> Outline:
        """Return the outline moved to the right and down."""
        return Outline(tuple((x + dx, y + dy) for x, y in self.points))

    @property
    def is_in_square(self) -> bool:
        """Whether the whole outline is in the image's middle square."""
        return all(0 <= place <= 1 for point in self.points for place in point)

    def kept_inside(self, reach: Reach = SQUARE) -> Outline:
        """Return the outline moved so that at least its edge is in the image."""
        if not self.points:
            return self
        shifts = []
        for ends, half in zip(zip(*self.points, strict=True), reach, strict=True):
            first, last = 0.5 - half + EDGE, 0.5 + half - EDGE
            shifts.append(max(first - max(ends), 0.0) or min(last - min(ends), 0.0))
        return self.moved(*shifts) if any(shifts) else self

    def mask(self, shape: Shape) -> Mask:
        """Return the pixels whose centres lie inside, in an image of this shape.

        An outline smaller than a pixel has the one nearest to its middle. Raises
        :class:`RenderError` if the whole outline is outside the image.
        """
        if not self.points:
            return np.ones(_rows_and_columns(shape), dtype=bool)
        # A slow import, not needed for whole images.
        from skimage.draw import polygon2mask

        size = np.array(_rows_and_columns(shape))
        square = size.min()
        corners = np.array(self.points)[:, ::-1] * square + (size - square) / 2 - 0.5
        mask: Mask = polygon2mask(_rows_and_columns(shape), corners)
        if not mask.any():
            lowest, highest = corners.min(axis=0) + 0.5, corners.max(axis=0) + 0.5
            if (highest <= 0).any() or (lowest >= size).any():
                raise RenderError("The region lies outside the image; draw it inside.")
            middle = (np.maximum(lowest, 0) + np.minimum(highest, size)) / 2
            row, column = np.minimum(middle.astype(int), size - 1)
            mask[row, column] = True
        return mask


ImageRegion = Region | Outline  # part of an image: of any size, or of one size only


def _rows_and_columns(shape: Shape) -> tuple[int, int]:
    return (shape, shape) if isinstance(shape, int) else shape


def windows_of(mask: Mask) -> NDArray[np.int64]:
    """Divide a mask into rectangles, the runs of pixels in each row.

    Each row (4,) of the result: first row, row after the last, first column, column after the last.
    """
    padded = np.zeros((len(mask), mask.shape[1] + 2), dtype=np.int8)
    padded[:, 1:-1] = mask
    steps = np.diff(padded, axis=1)
    rows, starts = np.nonzero(steps == 1)
    _, ends = np.nonzero(steps == -1)
    return np.stack([rows, rows + 1, starts, ends], axis=1).astype(np.int64)


def block_edges(size: int, block: int) -> list[int]:
    """Return the edges of blocks along an axis: first pixels and `size`; the last may be smaller.

    Raises :class:`RenderError` for a block size outside 1 to `size`.
    """
    if not 1 <= block <= size:
        raise RenderError(f"Blocks of {block} pixels do not fit into {size}; give 1 to {size}.")
    return [*range(0, size, block), size]


def block_sums(values: NDArray[np.float64], edges: list[int]) -> NDArray[np.float64]:
    """Sums (n, n) of an image's values over the blocks between edges."""
    starts = edges[:-1]
    return np.asarray(np.add.reduceat(np.add.reduceat(values, starts, axis=0), starts, axis=1))
