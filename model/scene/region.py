"""Regions of an image: the rectangles that sensitivities are taken over."""

from __future__ import annotations

from dataclasses import dataclass

from model.errors import RenderError


@dataclass(frozen=True)
class Region:
    """A rectangle of pixels: left and top inside it, right and bottom just outside."""

    left: int
    top: int
    right: int
    bottom: int

    @classmethod
    def parse(cls, text: str) -> Region:
        """Read ``"LEFT,TOP,RIGHT,BOTTOM"``."""
        try:
            return cls(*(int(part) for part in text.split(",")))
        except (ValueError, TypeError):
            raise RenderError(
                f"'{text}' is not a region; give left,top,right,bottom in pixels from the upper "
                "left corner, such as 100,80,140,120."
            ) from None

    def check(self, size: int) -> None:
        """Raise :class:`RenderError` unless the region lies in an image of this size."""
        if not (0 <= self.left < self.right <= size and 0 <= self.top < self.bottom <= size):
            raise RenderError(
                f"The region from ({self.left}, {self.top}) to ({self.right}, {self.bottom}) is "
                f"empty or outside the image of {size} x {size} pixels."
            )


def block_edges(size: int, block: int) -> list[int]:
    """Where the blocks of an image begin, and its end; the last block may be smaller.

    Raises
    ------
    RenderError
        For a block size outside 1 to `size`.
    """
    if not 1 <= block <= size:
        raise RenderError(f"Blocks of {block} pixels do not fit into {size}; give 1 to {size}.")
    return [*range(0, size, block), size]
