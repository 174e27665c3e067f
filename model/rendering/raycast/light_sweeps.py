"""Sweeps of light through a coarse grid of extinction, their changes and derivatives.

Light goes from layer to layer of nodes. What reaches a node is that of a square of four nodes in
the layer before, times exp(-e l) for their extinction e and the length l of the way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.compilation import compiled, inlined
from model.scene.transfer_function import TF_SAMPLES

DARK, DARKEST = np.float32(1e-20), np.float32(-46)  # light that counts as none, and its logarithm
VOXELS = 4  # voxels sampled around a node, along each axis
NODE_LEVELS = VOXELS**3  # voxels sampled around a node
ZERO = np.float32(0)


@dataclass(frozen=True)
class Sweep:
    """Way of a distant light through a grid."""

    axes: tuple[int, int, int]
    """Axes of an array (nz, ny, nx), the one that is swept layer by layer first."""
    step: int  # along the first one
    slope: tuple[float, float, np.float32]
    """Displacement along the other two between adjacent layers, in grid steps, at most 1 in
    magnitude; and the world length of the way between these layers."""

    @classmethod
    def along(cls, steps: NDArray[np.float64]) -> Sweep:
        """Return the way of a light that takes so many grid steps along x, y and z per length."""
        order = np.argsort(-np.abs(steps), kind="stable")
        z, y, x = (2 - order).tolist()
        along, u, v = steps[order].tolist()
        length = 1 / abs(along)
        return cls((z, y, x), 1 if along > 0 else -1, (u * length, v * length, np.float32(length)))

    def layers_of(self, grid: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a grid (nz, ny, nx) by layers, in the order in which light meets them."""
        return np.ascontiguousarray(np.transpose(grid, self.axes)[:: self.step])

    def in_place(self, layers: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return what :meth:`layers_of` has made in the grid's own order."""
        return np.ascontiguousarray(np.transpose(layers[:: self.step], np.argsort(self.axes)))


def look_around(
    scalars: NDArray[Any],
    missing: NDArray[np.bool_] | None,
    bins: tuple[float, float],
    layer: int,
    out: NDArray[np.uint16],
) -> None:
    """Find the TF bins of voxels around each node of a layer, :data:`VOXELS` along each axis."""
    offset, factor = bins
    nz, ny, nx = out.shape[:3]
    depths, rows, columns = map(_voxels_around, (nz, ny, nx), scalars.shape)
    around = np.ix_(depths[layer], rows.ravel(), columns.ravel())
    found = scalars[around].astype(np.float64)
    found -= offset
    found *= factor
    found += 0.5
    levels = np.clip(found, 0, TF_SAMPLES - 0.5, out=found).astype(np.uint16)
    if missing is not None:
        levels[missing[around]] = TF_SAMPLES
    of_nodes = levels.reshape(VOXELS, ny, VOXELS, nx, VOXELS).transpose(1, 3, 0, 2, 4)
    out[layer] = of_nodes.reshape(ny, nx, NODE_LEVELS)


def _voxels_around(count: int, voxels: int) -> NDArray[np.int64]:
    """Return the voxels (count, VOXELS) in the middle of parts of those around nodes of an axis."""
    size = (voxels - 1) / (count - 1)
    nodes = np.arange(count)[:, None]
    first = np.maximum(np.ceil((nodes - 0.5) * size), 0).astype(np.int64)
    last = np.minimum(np.floor((nodes + 0.5) * size) + 1, voxels).astype(np.int64)
    return first + (2 * np.arange(VOXELS) + 1) * (last - first) // (2 * VOXELS)


@compiled
def average_levels(levels, tables, layer, out):
    """Average tables (257, m) over the levels around each node of a layer of (nz, ny, nx, n)."""
    _, ny, nx, count = levels.shape
    tables_count = tables.shape[1]
    total = np.empty(tables_count, dtype=np.float32)
    for j in range(ny):
        for i in range(nx):
            if tables_count == 1:
                alone = ZERO
                for n in range(count):
                    alone += tables[np.uint64(levels[layer, j, i, n]), 0]
                out[0, layer, j, i] = alone / np.float32(count)
                continue
            total[:] = ZERO
            for n in range(count):
                level = np.uint64(levels[layer, j, i, n])
                for m in range(tables_count):
                    total[m] += tables[level, m]
            for m in range(tables_count):
                out[m, layer, j, i] = total[m] / np.float32(count)


@compiled
def add_by_level(levels, weights, table):
    """Add the weights of averages (ny, nx) to the table entries that they average."""
    ny, nx, count = levels.shape
    for j in range(ny):
        for i in range(nx):
            weight = weights[j, i] / np.float32(count)
            if weight != ZERO:
                for n in range(count):
                    table[np.uint64(levels[j, i, n])] += weight


@compiled
def sweep_layers(values, slope, passed, clear, out):
    """Propagate light through extinctions from layer to layer along the first axis.

    A node's own extinction does not attenuate its light: opaque surfaces would otherwise be dark,
    as their coarse nodes also cover the space in front of them. Where light has `passed` and nodes
    are so `clear`, values are changes of the extinction, and what is propagated is that of the
    light: the sweep's tangent.
    """
    layers, rows, columns = out.shape
    u, v, length = slope
    is_change, keeps = len(passed) > 0, len(clear) > 0
    first = ZERO if is_change else np.float32(1)
    # The light comes from a square of nodes, the same for all but for those near the faces;
    # a margin, in which light is not attenuated, stands for what lies outside the volume.
    light = np.full((rows + 3, columns + 3), first)
    dark = np.zeros((rows + 3, columns + 3), dtype=np.float32)
    top, left, down, right = _square(u, v)
    out[0] = first
    for n in range(1, layers):
        light[1 : rows + 1, 1 : columns + 1] = out[n - 1]
        dark[1 : rows + 1, 1 : columns + 1] = values[n - 1]
        for j in range(rows):
            # Rows as arrays of their own, so that the loops over them are vectorized.
            bright, bright_below = light[1 + j + top, 1 + left :], light[2 + j + top, 1 + left :]
            dim, dim_below = dark[1 + j + top, 1 + left :], dark[2 + j + top, 1 + left :]
            if is_change:
                for i in range(columns):
                    received = _mixed(bright, bright_below, i, down, right)
                    path = _mixed(dim, dim_below, i, down, right)
                    change = received * clear[n, j, i] - path * length * passed[n, j, i]
                    out[n, j, i] = change if abs(change) > DARK else ZERO
                continue
            for i in range(columns):
                received = _mixed(bright, bright_below, i, down, right)
                path = _mixed(dim, dim_below, i, down, right)
                # Not below DARK: arithmetic on denormal numbers takes 100 times as long.
                through = math.exp(max(-path * length, DARKEST))
                is_dark = received * through <= DARK
                out[n, j, i] = ZERO if is_dark else received * through
                if keeps:
                    clear[n, j, i] = ZERO if is_dark else through


@compiled
def sweep_back(weights, slope, passed, clear, out):
    """Turn a derivative by a sweep's light into one by the extinction: its adjoint."""
    layers, rows, columns = out.shape
    u, v, length = slope
    light = np.empty((rows + 3, columns + 3), dtype=np.float32)
    dark = np.empty((rows + 3, columns + 3), dtype=np.float32)
    top, left, down, right = _square(u, v)
    out[layers - 1] = ZERO
    for n in range(layers - 1, 0, -1):
        light[:] = ZERO
        dark[:] = ZERO
        for j in range(rows):
            near, far = 1 + j + top, 2 + j + top
            for i in range(columns):
                weight = weights[n, j, i]
                if abs(weight) > DARK:
                    at = 1 + i + left
                    _divide(light, near, far, at, down, right, weight * clear[n, j, i])
                    change = -weight * length * passed[n, j, i]
                    _divide(dark, near, far, at, down, right, change)
        for j in range(rows):
            for i in range(columns):
                weights[n - 1, j, i] += light[j + 1, i + 1]
                out[n - 1, j, i] = dark[j + 1, i + 1]


@inlined
def _square(u, v):
    """Return first row and column of the square that light comes from, and its place in it."""
    top, left = math.floor(-u), math.floor(-v)
    return top, left, np.float32(-u - top), np.float32(-v - left)


@inlined
def _mixed(row, below, at, down, right):
    """Interpolate between two rows, and between a column and the next."""
    first = row[at] + right * (row[at + 1] - row[at])
    second = below[at] + right * (below[at + 1] - below[at])
    return first + down * (second - first)


@inlined
def _divide(grid, near, far, at, down, right, value):
    """Add a value to the four nodes that :func:`_mixed` interpolates between."""
    below = down * value
    above = value - below
    grid[near, at] += (np.float32(1) - right) * above
    grid[near, at + 1] += right * above
    grid[far, at] += (np.float32(1) - right) * below
    grid[far, at + 1] += right * below
