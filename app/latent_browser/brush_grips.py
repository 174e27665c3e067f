"""The brush on the map: where the mouse grips it, and what a drag makes of it."""

from __future__ import annotations

from typing import Literal

from PySide6.QtCore import QPointF, Qt

from app.latent_browser.map_frame import MapFrame
from model.latent.interpolation import Brush

Grip = Literal["new", "move", "pan", "lasso", "left", "right", "lower", "upper"]

REACH = 7
"""Distance in pixels at which the brush's edges are gripped."""


def grips_at(frame: MapFrame, brush: Brush, at: QPointF) -> tuple[Grip, ...]:
    """Return the edges of the brush at a pixel, "move" inside it, nothing outside."""
    rect = frame.rectangle(brush)
    if not rect.adjusted(-REACH, -REACH, REACH, REACH).contains(at):
        return ()
    grips: list[Grip] = []
    if abs(at.x() - rect.left()) <= REACH:
        grips.append("left")
    elif abs(at.x() - rect.right()) <= REACH:
        grips.append("right")
    if abs(at.y() - rect.bottom()) <= REACH:
        grips.append("lower")
    elif abs(at.y() - rect.top()) <= REACH:
        grips.append("upper")
    return tuple(grips) or ("move",)


def dragged(
    grips: tuple[Grip, ...], before: Brush, start: tuple[float, float], end: tuple[float, float]
) -> Brush:
    """Return the brush after a drag from one place of the map to another."""
    (ax, ay), (bx, by) = start, end
    if grips == ("new",):
        return min(ax, bx), min(ay, by), max(ax, bx), max(ay, by)
    left, lower, right, upper = before
    dx, dy = bx - ax, by - ay
    if grips == ("move",):
        return left + dx, lower + dy, right + dx, upper + dy
    left += dx if "left" in grips else 0
    right += dx if "right" in grips else 0
    lower += dy if "lower" in grips else 0
    upper += dy if "upper" in grips else 0
    return min(left, right), min(lower, upper), max(left, right), max(lower, upper)


def cursor_of(grips: tuple[Grip, ...]) -> Qt.CursorShape:
    """Return the shape of the mouse over what it would grip."""
    shapes = Qt.CursorShape
    if grips in (("left", "lower"), ("right", "upper")):
        return shapes.SizeBDiagCursor
    if grips in (("left", "upper"), ("right", "lower")):
        return shapes.SizeFDiagCursor
    if grips in (("left",), ("right",)):
        return shapes.SizeHorCursor
    if grips in (("lower",), ("upper",)):
        return shapes.SizeVerCursor
    return shapes.CrossCursor
