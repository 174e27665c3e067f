"""Rectangular image regions, over which sensitivities are computed."""

from __future__ import annotations

from dataclasses import dataclass

from model.errors import RenderError


@dataclass(frozen=True)
class Region:
    """Rectangle of pixels; left and top are inclusive, right and bottom exclusive."""

    left: int
    top: int
    right: int
    bottom: int

    @classmethod
    def parse(cls, text: str) -> Region:
        """Parse ``"LEFT,TOP,RIGHT,BOTTOM"`` in pixels.

        Raises
        ------
        RenderError
            When the text is not four integers.
        """
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
    """Return the blocks' first pixels along an axis, and `size`; the last block may be smaller.

    Raises
    ------
    RenderError
        For a block size outside 1 to `size`.
    """
    if not 1 <= block <= size:
        raise RenderError(f"Blocks of {block} pixels do not fit into {size}; give 1 to {size}.")
    return [*range(0, size, block), size]
