"""Where the card of a handle stands: beside it, in the plot, over no flag, handle or label."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QPoint, QRect, QSize

SHIFTS = 0, -14, 14, -24, 24
"""By how much it may stand higher or lower than its handle, in pixels."""

ROOM = 3
"""Least distance from the plot's edges and from flags, in pixels."""


def free_corner(
    at: QPoint,
    size: QSize,
    beside: int,
    plot: QRect,
    flags: Sequence[QRect],
    others: Sequence[QRect],
) -> QPoint:
    """Return a card's upper left corner, as near to its handle as may be.

    Parameters
    ----------
    at : QPoint
        The handle.
    size : QSize
        The card's.
    beside : int
        Its distance from the handle, in pixels.
    plot : QRect
        It lies inside.
    flags, others : sequence of QRect
        What it covers on no account, and what it covers only where it must.
    """
    inside = plot.adjusted(ROOM, ROOM, -ROOM, -ROOM)
    kept_clear = [flag.adjusted(-ROOM, -ROOM, ROOM, ROOM) for flag in flags]
    lowest = inside.bottom() + 1 - size.height()
    rightmost = inside.right() + 1 - size.width()
    middle = at.y() - size.height() // 2
    heights = [*(middle + shift for shift in SHIFTS), *(flag.bottom() + 1 for flag in kept_clear)]
    corners = [
        QPoint(x, min(max(y, inside.top()), lowest))
        for x in (at.x() + beside, at.x() - beside - size.width())
        if inside.left() <= x <= rightmost
        for y in heights
    ]
    # Above or below it, where there is no room beside it, or others are in the way.
    x = min(max(at.x() - size.width() // 2, inside.left()), rightmost)
    above_and_below = (at.y() - beside - size.height(), at.y() + beside)
    corners += [QPoint(x, y) for y in above_and_below if inside.top() <= y <= lowest]
    # In a plot hardly larger than the card, there is no such place.
    corners = corners or [QPoint(x, min(max(middle, inside.top()), lowest))]

    def cost(corner: QPoint) -> tuple[bool, int, int]:
        box = QRect(corner, size)
        covers = any(box.intersects(flag) for flag in kept_clear)
        hidden = sum(box.intersects(other) for other in others)
        return covers, hidden, abs(box.center().y() - at.y())

    return min(corners, key=cost)
