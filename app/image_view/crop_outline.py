"""What is seen of a crop box: its edges, and handles at the middles of its faces."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.crop import CropBox
from model.scene.projection import NEAREST_DEPTH, Projection

LEAST_SINE = 0.17
"""Of the angle between an axis and the line of sight, from which its planes can be dragged."""

Place = tuple[float, float]
"""To the right and up from the image's middle, in halves of its shorter side."""


@dataclass(frozen=True)
class Handle:
    """A handle at the middle of one of the box's faces.

    Attributes
    ----------
    axis, side : int
        Axis of the plane, and 0 for the lower one, 1 for the upper one.
    depth : float
        Distance in front of the eye.
    is_behind : bool
        Whether the box is in front of it.
    """

    axis: int
    side: int
    place: Place
    depth: float
    is_behind: bool


@dataclass(frozen=True)
class Edge:
    """An edge of the box, as far as it is in front of the eye.

    Attributes
    ----------
    is_behind : bool
        Whether the box is in front of it.
    """

    start: Place
    end: Place
    is_behind: bool


def handles_of(box: CropBox, projection: Projection) -> list[Handle]:
    """Return the handles that can be dragged in this view, the nearest one first."""
    visible = _visible_faces(box, projection)
    found = []
    for axis in range(3):
        line = axis_line(box, axis)
        for side, share in enumerate((box.low[axis], box.high[axis])):
            middle = line[0] + share * (line[1] - line[0])
            depth = float(projection.depths(middle[None])[0])
            if depth > NEAREST_DEPTH and _sine(projection, middle, axis) >= LEAST_SINE:
                place = _place(projection.places(middle[None])[0])
                found.append(Handle(axis, side, place, depth, not visible[axis][side]))
    return sorted(found, key=lambda handle: handle.depth)


def edges_of(box: CropBox, projection: Projection) -> list[Edge]:
    """Return the edges that are in front of the eye, those behind the box first."""
    visible = _visible_faces(box, projection)
    found = []
    for axis in range(3):
        second, third = (other for other in range(3) if other != axis)
        for sides in itertools.product((0, 1), repeat=2):
            start, end = np.array(box.low), np.array(box.high)
            start[second] = end[second] = (box.low, box.high)[sides[0]][second]
            start[third] = end[third] = (box.low, box.high)[sides[1]][third]
            part = projection.seen_part(start, end)
            if part is not None:
                first, last = projection.places(part)
                in_front = visible[second][sides[0]] or visible[third][sides[1]]
                found.append(Edge(_place(first), _place(last), not in_front))
    return sorted(found, key=lambda edge: not edge.is_behind)


def axis_line(box: CropBox, axis: int) -> NDArray[np.float64]:
    """Return the line that a plane's handle moves along, through all of the volume, (2, 3)."""
    line = np.tile((np.array(box.low) + np.array(box.high)) / 2, (2, 1))
    line[:, axis] = 0.0, 1.0
    return line


def _visible_faces(box: CropBox, projection: Projection) -> list[tuple[bool, bool]]:
    """Whether the lower and the upper face along each axis is turned to the eye."""
    sides = zip(projection.eye, box.low, box.high, strict=True)
    return [(bool(eye < low), bool(eye > high)) for eye, low, high in sides]


def _sine(projection: Projection, point: NDArray[np.float64], axis: int) -> float:
    """Sine of the angle between an axis and the line of sight through a point."""
    sight = (point - projection.eye) * np.array(projection.proportions)
    return math.sqrt(max(0.0, 1.0 - float(sight[axis]) ** 2 / float(sight @ sight)))


def _place(place: NDArray[np.float64]) -> Place:
    return float(place[0]), float(place[1])
