"""Sums of interpolated features along lines of sight, and their transpose, on a CPU's thread."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.compilation import compiled, inlined

ONE = np.float32(1)

FEATURES = 8
"""At each node; known when the loops are compiled, which halves their time."""


@compiled
def project(
    first: Any, step: Any, points: Any, weight: Any, shape: Any, features: Any, found: Any
) -> None:
    """Sum features up along lines of sight.

    Parameters
    ----------
    first, step : ndarray of float32, shape (R, 3)
    points : ndarray of int32, shape (R,)
    weight : ndarray of float32, shape (R,)
        See :class:`model.networks.grid.rays.Rays`.
    shape : tuple of 3 int
        Nodes along x, y and z.
    features : ndarray of float32, shape (nz * ny * nx, FEATURES)
        x fastest.
    found : ndarray of float32, shape (R, FEATURES)
        Output.
    """
    up, in_ = shape[0], shape[0] * shape[1]
    total = np.zeros(FEATURES, np.float32)
    for r in range(len(points)):
        for c in range(FEATURES):
            total[c] = 0
        for i in range(points[r]):
            a, x, y, z = _cell(first[r], step[r], i, shape)
            b, d, e = a + up, a + in_, a + in_ + up
            wa, wb, wd, we = (ONE - y) * (ONE - z), y * (ONE - z), (ONE - y) * z, y * z
            for c in range(FEATURES):
                left = (
                    wa * features[a, c]
                    + wb * features[b, c]
                    + wd * features[d, c]
                    + we * features[e, c]
                )
                right = (
                    wa * features[a + 1, c]
                    + wb * features[b + 1, c]
                    + wd * features[d + 1, c]
                    + we * features[e + 1, c]
                )
                total[c] += left + x * (right - left)
        for c in range(FEATURES):
            found[r, c] = weight[r] * total[c]


@compiled
def spread(
    first: Any, step: Any, points: Any, weight: Any, shape: Any, gradients: Any, total: Any
) -> None:
    """Add to the nodes what flows back to them from the sums.

    Parameters
    ----------
    first, step, points, weight, shape
        As those of :func:`project`.
    gradients : ndarray of float32, shape (R, FEATURES)
    total : ndarray of float32, shape (nz * ny * nx, FEATURES)
        Is added to.
    """
    up, in_ = shape[0], shape[0] * shape[1]
    for r in range(len(points)):
        row = gradients[r]
        for i in range(points[r]):
            a, x, y, z = _cell(first[r], step[r], i, shape)
            near, far = weight[r] * (ONE - z), weight[r] * z
            for node, share in (
                (a, (ONE - y) * near),
                (a + up, y * near),
                (a + in_, (ONE - y) * far),
                (a + in_ + up, y * far),
            ):
                left, right = total[node], total[node + 1]
                for c in range(len(row)):
                    left[c] += share * (ONE - x) * row[c]
                for c in range(len(row)):
                    right[c] += share * x * row[c]


@inlined
def _cell(first: Any, step: Any, i: int, shape: Any) -> Any:
    """First node of the cell around a line's point, and the point's place in the cell, 0..1."""
    along = np.float32(i)
    x, y, z = first[0] + along * step[0], first[1] + along * step[1], first[2] + along * step[2]
    ix = min(max(int(x), 0), shape[0] - 2)
    iy = min(max(int(y), 0), shape[1] - 2)
    iz = min(max(int(z), 0), shape[2] - 2)
    node = (iz * shape[1] + iy) * shape[0] + ix
    return node, x - np.float32(ix), y - np.float32(iy), z - np.float32(iz)
