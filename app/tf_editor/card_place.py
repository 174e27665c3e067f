"""Where the card of a handle stands: near it, in the plot, over no flag, handle, label or curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, QRect, QSize

ROOM = 3
"""Least distance from the plot's edges and from flags, in pixels."""

STEP, REACH = 12, 300
"""Distance between places to the side that are tried, and of the farthest, in pixels."""

DOWN = 4
"""Distance between heights that are tried, in pixels."""

OWN = 9
"""Half the side of the square that the card's own handle takes, in pixels."""


def free_corner(
    at: QPoint,
    size: QSize,
    beside: int,
    plot: QRect,
    flags: Sequence[QRect],
    others: Sequence[QRect],
    curve: Sequence[QRect] = (),
) -> QPoint:
    """Return a card's upper left corner, as near to its handle as may be.

    Parameters
    ----------
    at : QPoint
        The handle.
    size : QSize
        The card's.
    beside : int
        Its least distance from the handle to the side, in pixels.
    plot : QRect
        It lies inside.
    flags, others, curve : sequence of QRect
        What it covers only where it must, the first the least.
    """
    inside = plot.adjusted(ROOM, ROOM, -ROOM, -ROOM)
    rightmost = max(inside.right() + 1 - size.width(), inside.left())
    lowest = max(inside.bottom() + 1 - size.height(), inside.top())
    steps = np.arange(0, REACH, STEP)
    sides = [at.x() + beside + steps, at.x() - beside - size.width() - steps]
    sides.append(at.x() - np.arange(0, size.width(), STEP))
    xs = np.unique(np.concatenate(sides).clip(inside.left(), rightmost))
    x, y = (each.ravel() for each in np.meshgrid(xs, np.arange(inside.top(), lowest + 1, DOWN)))
    own = QRect(at.x() - OWN, at.y() - OWN, 2 * OWN, 2 * OWN)
    kept_clear = [flag.adjusted(-ROOM, -ROOM, ROOM, ROOM) for flag in flags]
    right, bottom = x + size.width() - 1, y + size.height() - 1
    aside = np.maximum(np.maximum(x - at.x(), at.x() - right), 0)
    above = np.maximum(np.maximum(y - at.y(), at.y() - bottom), 0)
    off_middle = np.abs((y + bottom) / 2 - at.y())
    hidden = [_hidden(x, y, size, boxes) for boxes in (kept_clear, [*others, own], curve)]
    # The last key decides first.
    best = np.lexsort((off_middle, np.hypot(aside, above), *reversed(hidden)))[0]
    return QPoint(int(x[best]), int(y[best]))


def _hidden(
    x: NDArray[np.int_], y: NDArray[np.int_], size: QSize, boxes: Sequence[QRect]
) -> NDArray[np.int_]:
    """Number of boxes that a card covers, for each of its corners."""
    edges = np.array([(b.left(), b.top(), b.right(), b.bottom()) for b in boxes]).reshape(-1, 4)
    left, top, right, bottom = edges.T[:, :, None]
    beside = (right < x) | (left > x + size.width() - 1)
    return np.sum(~(beside | (bottom < y) | (top > y + size.height() - 1)), axis=0)
