"""Illumination: parameters of gradient shading, and soft light.

Soft light follows the paper (section 6): one distant light and ambient light,
attenuated by the volume's extinction. The light that reaches each point, from the
distant light and from all directions, is computed by sweeps over a coarse grid of
the extinction.
"""

from __future__ import annotations

import itertools
import math
from concurrent.futures import Executor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.compilation import compiled, inlined
from model.rendering.opacity_correction import NEARLY_OPAQUE
from model.rendering.raycast.shading import Light, LightGrid
from model.rendering.raycast.trilinear import interpolate
from model.scene.crop import CropBox
from model.scene.light import LightDirection
from model.scene.transfer_function import TF_SAMPLES
from model.scene.view import View
from model.scene.volume import Geometry

DIFFUSE, SPECULAR, POWER = 0.9, 0.2, 20
"""Coefficients of gradient shading, equal to the reference renderer's."""

NOISE = 3.0
"""Gradient, in the noise's standard deviations, from which on a surface is rather seen than not.

The difference of two voxels has 1.4 of them along each axis, less between voxels."""

AMBIENT, DISTANT = 0.4, 0.65
"""Soft light: unoccluded ambient light and distant light."""

DARK, DARKEST = np.float32(1e-20), np.float32(-46)
"""Light that counts as none, and its logarithm."""

LONGEST_AXIS = 64
"""Nodes along the longest axis of the light grid."""

VOXELS = 4
"""Voxels along each axis that stand for those around a node."""

AROUND = [
    np.array(direction) / np.linalg.norm(direction)
    for direction in itertools.product((-1, 0, 1), repeat=3)
    if np.count_nonzero(direction) in (1, 3)
]
"""Directions of ambient light: the face centres and corners of a cube."""


def travel_direction(view: View, light: LightDirection) -> NDArray[np.float64]:
    """Unit vector, in world coordinates, in which a view's distant light travels."""
    return -np.array(light.towards()) @ view.basis()


def gradient_light(
    view: View,
    light: LightDirection,
    volume: Geometry,
    crop: CropBox | None = None,
    noise: float = 0.0,
    dim: float = 1.0,
) -> Light:
    """Return the parameters of gradient shading for a view and its light.

    Parameters
    ----------
    view, light, volume
    crop : CropBox, optional
        Part of the volume that is shown; all of it by default.
    noise : float
        Standard deviation of the voxels' noise.
    dim : float
        See :class:`model.rendering.raycast.shading.Light`.
    """
    crop = crop or CropBox()
    last = np.array(volume.dimensions) - 1
    return Light(
        tuple(map(np.float32, travel_direction(view, light))),
        tuple(map(np.float32, volume.spacing)),
        tuple(np.float32(1 / s) for s in volume.spacing),
        np.float32(DIFFUSE),
        np.float32(SPECULAR),
        POWER,
        tuple(map(np.float32, np.array(crop.low) * last)),
        tuple(map(np.float32, np.array(crop.high) * last)),
        np.float32((NOISE * noise) ** 4),
        np.float32(dim),
    )


class Illumination:
    """Light that reaches the points of a volume, on a coarse grid.

    Extinction and ambient light depend on the opacity TF only and are cached while
    the view changes. The distant light moves with the view; its shadows are
    recomputed for each view, by one sweep.

    Parameters
    ----------
    scalars : ndarray, shape (nz, ny, nx)
    bins : tuple of float
        Lowest scalar value, and TF bins per unit of scalar value.
    executor : Executor
        Threads for the computation.
    longest : int
        Number of nodes along the longest axis.
    ambient_longest : int, optional
        The same for ambient light, which takes a sweep for each of its 14 directions and
        changes less from node to node; as many by default.
    missing : ndarray of bool, shape (nz, ny, nx), optional
        Voxels that are transparent whatever the TF is.
    """

    def __init__(
        self,
        scalars: NDArray[Any],
        bins: tuple[float, float],
        volume: Geometry,
        executor: Executor,
        longest: int = LONGEST_AXIS,
        ambient_longest: int | None = None,
        missing: NDArray[np.bool_] | None = None,
    ) -> None:
        extent = np.array(volume.extent)
        dimensions = np.array(volume.dimensions)
        counts = np.ceil(longest * extent / extent.max()).astype(int)
        self._counts = np.clip(counts, 2, dimensions)
        self._spacing = extent / (self._counts - 1)
        self._scale = ((self._counts - 1) / (dimensions - 1)).astype(np.float32)
        self._volume, self._executor = volume, executor
        # TF bins once for all TFs: 16 MB for a cube of 64 nodes.
        kind: Any = np.uint8 if missing is None else np.uint16
        self._levels = np.empty((*self._counts[::-1], VOXELS**3), dtype=kind)

        def look(layer: int) -> None:
            _look_around(scalars, missing, bins, layer, self._levels)

        list(executor.map(look, range(len(self._levels))))
        self._opacities: NDArray[np.float32] | None = None
        self._crop: CropBox | None = None
        self._coarser = (
            Illumination(scalars, bins, volume, executor, ambient_longest, missing=missing)
            if ambient_longest is not None
            else None
        )

    def grid(
        self,
        view: View,
        light: LightDirection,
        opacities: NDArray[np.float32],
        crop: CropBox | None = None,
        dim: float = 1.0,
    ) -> LightGrid:
        """Compute the light for a view, a light direction and the opacity TF's 256 samples.

        What a crop box leaves out casts no shadow; for `dim` see
        :class:`model.rendering.raycast.shading.Light`.
        """
        known = self._opacities is not None and np.array_equal(opacities, self._opacities)
        if not known or crop != self._crop:
            self._crop = crop
            self._extinction = self._mean_extinction(opacities)
            self._ambient = self._ambient_light(opacities)
            self._opacities = opacities.copy()
        distant = self._sweep(travel_direction(view, light))
        received = np.float32(AMBIENT) * self._ambient + np.float32(DISTANT) * distant
        nx, ny, nz = map(int, self._counts)
        sx, sy, sz = self._scale
        # Light above 1 would exceed the colour range.
        grid = np.minimum(received, 1).reshape(-1)
        return LightGrid(grid, (nx, ny, nz), (sx, sy, sz), np.float32(dim))

    def _ambient_light(self, opacities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Light from all directions at each node, for the extinction of these opacities."""
        if self._coarser is None:
            return np.asarray(np.mean(list(self._executor.map(self._sweep, AROUND)), axis=0))
        self._coarser._crop = self._crop
        self._coarser._extinction = self._coarser._mean_extinction(opacities)
        enlarged = np.empty_like(self._extinction)
        _enlarge(self._coarser._ambient_light(opacities), enlarged)
        return enlarged

    def _mean_extinction(self, opacities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Mean extinction per world length around each grid node."""
        opacity = np.minimum(opacities.astype(np.float64), NEARLY_OPAQUE)
        # One more, of missing voxels.
        table = np.zeros(TF_SAMPLES + 1, dtype=np.float32)
        table[:TF_SAMPLES] = -np.log1p(-opacity) / self._volume.voxel_size
        extinction = np.empty(self._counts[::-1], dtype=np.float32)

        def fill(layer: int) -> None:
            _average(self._levels[layer], table, extinction[layer])

        list(self._executor.map(fill, range(len(extinction))))
        return extinction if self._crop is None else extinction * self._shares(self._crop)

    def _shares(self, crop: CropBox) -> NDArray[np.float32]:
        """Share of the space around each node that lies in a crop box."""
        along = []
        for low, high, count in zip(crop.low, crop.high, self._counts, strict=True):
            places = np.arange(count)
            before = np.maximum(places - 0.5, low * (count - 1))
            behind = np.minimum(places + 0.5, high * (count - 1))
            inside = np.clip(behind - before, 0, 1)
            # Half of the space around the outermost nodes lies outside the volume.
            inside[[0, -1]] = np.minimum(2 * inside[[0, -1]], 1)
            along.append(inside.astype(np.float32))
        x, y, z = along
        return np.asarray(z[:, None, None] * y[:, None] * x, dtype=np.float32)

    def _sweep(self, direction: NDArray[np.float64]) -> NDArray[np.float32]:
        """Fraction of a distant light that reaches each grid node.

        Parameters
        ----------
        direction : ndarray, shape (3,)
            World direction in which the light travels.
        """
        # Axes sorted by the light's steps along them; the first is swept layer by layer.
        steps = direction / self._spacing
        order = np.argsort(-np.abs(steps), kind="stable")
        axes = tuple(2 - order)
        along, u, v = steps[order]
        backwards = slice(None, None, 1 if along > 0 else -1)
        extinction = np.ascontiguousarray(np.transpose(self._extinction, axes)[backwards])
        transmitted = np.empty_like(extinction)
        length = 1 / abs(along)
        _sweep_layers(extinction, u * length, v * length, np.float32(length), transmitted)
        return np.ascontiguousarray(np.transpose(transmitted[backwards], np.argsort(axes)))


@compiled
def _look_around(scalars: Any, missing: Any, bins: Any, layer: int, out: Any) -> None:
    """Find the TF bins of voxels around each node of a layer, :data:`VOXELS` along each axis."""
    offset, factor = bins
    nz, ny, nx = out.shape[:3]
    for j in range(ny):
        for i in range(nx):
            n = 0
            for c in range(VOXELS):
                z = _voxel(layer, nz, scalars.shape[0], c)
                for b in range(VOXELS):
                    y = _voxel(j, ny, scalars.shape[1], b)
                    for a in range(VOXELS):
                        x = _voxel(i, nx, scalars.shape[2], a)
                        level = (scalars[z, y, x] - offset) * factor + 0.5
                        out[layer, j, i, n] = int(min(max(level, 0.0), TF_SAMPLES - 0.5))
                        if missing is not None and missing[z, y, x]:
                            out[layer, j, i, n] = TF_SAMPLES
                        n += 1


@inlined
def _voxel(index: int, count: int, voxels: int, part: int) -> int:
    """Return the voxel in the middle of a part of those around a node, along an axis."""
    size = (voxels - 1) / (count - 1)
    first = max(math.ceil((index - 0.5) * size), 0)
    last = min(math.floor((index + 0.5) * size) + 1, voxels)
    return first + (2 * part + 1) * (last - first) // (2 * VOXELS)


@compiled
def _average(levels: Any, table: Any, out: Any) -> None:
    """Average a table's values over the levels (ny, nx, n) around each node of a layer."""
    ny, nx, count = levels.shape
    for j in range(ny):
        for i in range(nx):
            total = np.float32(0)
            for n in range(count):
                total += table[np.uint64(levels[j, i, n])]
            out[j, i] = total / np.float32(count)


@compiled
def _enlarge(grid: Any, out: Any) -> None:
    """Interpolate a grid at the nodes of a finer one over the same extent."""
    shape = (grid.shape[2], grid.shape[1], grid.shape[0])
    nz, ny, nx = out.shape
    flat = grid.reshape(-1)
    for k in range(nz):
        z = np.float32(k * (shape[2] - 1) / (nz - 1))
        for j in range(ny):
            y = np.float32(j * (shape[1] - 1) / (ny - 1))
            for i in range(nx):
                x = np.float32(i * (shape[0] - 1) / (nx - 1))
                out[k, j, i] = interpolate(flat, shape, x, y, z)


@compiled
def _sweep_layers(extinction: Any, u: float, v: float, length: Any, out: Any) -> None:
    """Propagate light from layer to layer along the first axis.

    A node's own extinction does not attenuate its light: opaque surfaces would
    otherwise be dark, as their coarse nodes also cover the space in front of them.

    Parameters
    ----------
    u, v : float
        Displacement of the light along the other two axes between adjacent
        layers, in grid steps; at most 1 in magnitude.
    length : float32
        World length of its path between adjacent layers.
    """
    layers, rows, columns = out.shape
    # The light comes from a square of nodes, the same for all but for those near the faces;
    # a margin, in which light is not attenuated, stands for what lies outside the volume.
    light = np.ones((rows + 3, columns + 3), dtype=np.float32)
    dark = np.zeros((rows + 3, columns + 3), dtype=np.float32)
    top, left = math.floor(-u), math.floor(-v)
    down, right = np.float32(-u - top), np.float32(-v - left)
    out[0] = 1
    for n in range(1, layers):
        light[1 : rows + 1, 1 : columns + 1] = out[n - 1]
        dark[1 : rows + 1, 1 : columns + 1] = extinction[n - 1]
        for j in range(rows):
            near, far = 1 + j + top, 2 + j + top
            for i in range(columns):
                at = 1 + i + left
                received = _mixed(light, near, far, at, down, right)
                path = _mixed(dark, near, far, at, down, right)
                # Ever smaller numbers would end as denormal ones, which take 100 times as long.
                rest = received * math.exp(max(-path * length, DARKEST))
                out[n, j, i] = rest if rest > DARK else np.float32(0)


@inlined
def _mixed(grid: Any, near: int, far: int, at: int, down: Any, right: Any) -> Any:
    """Interpolate between two rows of a grid, and between a column and the next."""
    first = grid[near, at] + right * (grid[near, at + 1] - grid[near, at])
    second = grid[far, at] + right * (grid[far, at + 1] - grid[far, at])
    return first + down * (second - first)
