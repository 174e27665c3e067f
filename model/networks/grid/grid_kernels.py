"""Trilinear interpolation of many features at once, and its transpose, on a CPU's thread."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from model.compilation import compiled, inlined

ZERO, ONE = np.float32(0), np.float32(1)


@compiled
def gather(points: Any, shape: Any, features: Any, found: Any) -> None:
    """Interpolate features at points.

    Parameters
    ----------
    points : ndarray of float32, shape (P, 3)
        x, y, z; the grid reaches from -1 to 1 and is surrounded by zeros.
    shape : tuple of 3 int
        Nodes along x, y and z.
    features : ndarray of float32, shape (nz * ny * nx, channels)
        x fastest.
    found : ndarray of float32, shape (P, channels)
        Output.
    """
    for p in range(len(points)):
        nodes, weights = _corners(points, p, shape)
        row = found[p]
        # One node after the other: Numba makes vectors of short loops over two arrays.
        for c in range(len(row)):
            row[c] = ZERO
        for corner in range(8):
            weight = weights[corner]
            if weight != ZERO:
                node = features[nodes[corner]]
                for c in range(len(row)):
                    row[c] += weight * node[c]


@compiled
def scatter(points: Any, shape: Any, gradients: Any, total: Any) -> None:
    """Add to the nodes what flows back to them from interpolated points.

    Parameters
    ----------
    points, shape
        As those of :func:`gather`.
    gradients : ndarray of float32, shape (P, channels)
    total : ndarray of float32, shape (nz * ny * nx, channels)
        Is added to.
    """
    for p in range(len(points)):
        nodes, weights = _corners(points, p, shape)
        row = gradients[p]
        for corner in range(8):
            weight = weights[corner]
            if weight != ZERO:
                node = total[nodes[corner]]
                for c in range(len(row)):
                    node[c] += weight * row[c]


@inlined
def _corners(points: Any, p: int, shape: Any) -> Any:
    """The eight nodes around a point, and their weights; 0 for those outside the grid."""
    x0, x1, ax, bx = _ends(points[p, 0], shape[0])
    y0, y1, ay, by = _ends(points[p, 1], shape[1])
    z0, z1, az, bz = _ends(points[p, 2], shape[2])
    a, b = shape[0] * (y0 + shape[1] * z0), shape[0] * (y1 + shape[1] * z0)
    c, d = shape[0] * (y0 + shape[1] * z1), shape[0] * (y1 + shape[1] * z1)
    va, vb, vc, vd = ay * az, by * az, ay * bz, by * bz
    nodes = (a + x0, a + x1, b + x0, b + x1, c + x0, c + x1, d + x0, d + x1)
    return nodes, (va * ax, va * bx, vb * ax, vb * bx, vc * ax, vc * bx, vd * ax, vd * bx)


@inlined
def _ends(place: Any, count: int) -> Any:
    """The two nodes around a place along one axis, and their weights."""
    x = (place + ONE) * np.float32(0.5) * np.float32(count - 1)
    i = math.floor(x)
    share = x - np.float32(i)
    first = ONE - share if 0 <= i < count else ZERO
    second = share if -1 <= i < count - 1 else ZERO
    return min(max(i, 0), count - 1), min(max(i + 1, 0), count - 1), first, second
