"""Illumination: a scene's light as kernels take it, by gradient shading or from a grid.

Soft light follows the paper (section 6): one distant light and ambient light, attenuated by the
volume's extinction, or by a share of it. The light that reaches each point, from the distant light
and from all directions, is computed by sweeps over a coarse grid of the extinction.
"""

from __future__ import annotations

import itertools
from concurrent.futures import Executor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from model.rendering.opacity_correction import NEARLY_OPAQUE
from model.rendering.raycast.light_sweeps import (
    NODE_LEVELS,
    Sweep,
    add_by_level,
    average_levels,
    look_around,
    sweep_back,
    sweep_layers,
)
from model.rendering.raycast.shading import Light, LightGrid, faces_of
from model.scene.clip_plane import WHOLE_PART, ShownPart
from model.scene.scene import LightDirection
from model.scene.transfer_function import TF_SAMPLES
from model.scene.view import View
from model.scene.volume import Volume

Floats = NDArray[np.float32]

DIFFUSE, SPECULAR, POWER = 0.9, 0.2, 20
"""Coefficients of gradient shading, equal to the reference renderer's."""

NOISE = 3.0
"""Gradient, in standard deviations of the noise, above which a surface is more likely than noise.

The difference of two voxels has 1.4 of them along each axis, less between voxels."""

AMBIENT, DISTANT = 0.4, 0.65  # soft light: unoccluded ambient light and distant light
SHADOW = 0.35
"""Share of the extinction by which soft light fades: matter scatters the rest on, as path-traced
light. If all of it faded, what lies behind much faint matter would be nearly black."""

LEARNED_SHADOW = 1.0  # of the soft light that the network for path-traced light has learned from

LONGEST_AXIS, COARSE = 64, 32  # nodes along the longest axis of a light's grid, usual and coarse

NOTHING = np.empty((0, 0, 0), dtype=np.float32)
"""Argument of a sweep for an output that is not requested."""

AROUND = [
    np.array(direction) / np.linalg.norm(direction)
    for direction in itertools.product((-1, 0, 1), repeat=3)
    if np.count_nonzero(direction) in (1, 3)
]
"""Directions of ambient light: the face centres and corners of a cube."""


def travel_direction(view: View, light: LightDirection) -> NDArray[np.float64]:
    """Unit vector, in world coordinates, in which a view's distant light travels."""
    return -np.array(light.towards()) @ view.basis()


def node_distance(volume: Volume) -> float:
    """Return the largest distance of two nodes next to each other in the usual grid."""
    return max(*volume.spacing, max(volume.extent) / (LONGEST_AXIS - 1))


def gradient_light(
    travel: NDArray[np.float64], volume: Volume, part: ShownPart, noise: float, dim: float
) -> Light:
    """Return the parameters of gradient shading for a direction in which light travels."""
    return Light(
        tuple(map(np.float32, travel)),
        tuple(map(np.float32, volume.spacing)),
        tuple(np.float32(1 / s) for s in volume.spacing),
        np.float32(DIFFUSE),
        np.float32(SPECULAR),
        POWER,
        faces_of(part, volume),
        np.float32((NOISE * noise) ** 4),
        np.float32(dim),
        True,
    )


class SoftLight(NamedTuple):
    """Inputs of soft light."""

    travel: NDArray[np.float64]  # direction in which the distant light travels
    opacities: Floats  # the opacity TF's 256 samples
    part: ShownPart = WHOLE_PART  # what is not shown casts no shadow
    blur: float = 0.0  # share of each of two neighbours in the light at a node, along each axis
    shadow: float = 1.0  # see :data:`SHADOW`

    def blurred(self, light: NDArray[np.floating]) -> NDArray[np.floating]:
        """Blur light at nodes (..., nz, ny, nx); this is its own adjoint.

        Otherwise each node would show as a ring on surfaces.
        """
        for axis in (-3, -2, -1) if self.blur > 0 else ():
            shares = self.blur, 1 - 2 * self.blur, self.blur
            light = correlate1d(light, shares, axis, mode="nearest")
        return light


class Illumination:
    """Light that reaches the points of a volume, on a coarse grid.

    Extinction and ambient light depend on the opacity TF only and are cached while the view
    changes, for two alternating TFs. The distant light moves with the view and is swept each time.
    """

    def __init__(
        self,
        scalars: NDArray[Any],
        bins: tuple[float, float],
        volume: Volume,
        executor: Executor,
        longest: int = LONGEST_AXIS,
        missing: NDArray[np.bool_] | None = None,
    ) -> None:
        extent = np.array(volume.extent)
        dimensions = np.array(volume.dimensions)
        counts = np.ceil(longest * extent / extent.max()).astype(int)
        self._counts = np.clip(counts, 2, dimensions)
        self._spacing = extent / (self._counts - 1)
        self._scale = ((self._counts - 1) / (dimensions - 1)).astype(np.float32)
        self._volume, self._executor = volume, executor
        # TF bins once for all TFs: 32 MB for a cube of 64 nodes.
        self._levels = np.empty((*self._counts[::-1], NODE_LEVELS), dtype=np.uint16)

        def look(layer: int) -> None:
            look_around(scalars, missing, bins, layer, self._levels)

        list(executor.map(look, range(len(self._levels))))
        # Extinction and ambient light of the two TFs and shown parts that were lit last.
        self._lit: dict[tuple[bytes, ShownPart], tuple[Floats, Floats]] = {}
        self._part = WHOLE_PART

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes along z, y and x."""
        nx, ny, nz = map(int, self._counts)
        return nz, ny, nx

    def grid(self, soft: SoftLight, dim: float = 1.0) -> LightGrid:
        """Compute the light; for `dim` see :class:`Light`."""
        # Light above 1 would exceed the colour range.
        return self._as_grid(soft.blurred(np.minimum(self._received(soft), 1)).reshape(-1), dim)

    def changes(self, soft: SoftLight, edits: Floats) -> LightGrid:
        """Compute the change of the light at each node per unit of edits (n, 256)."""
        is_below = self._received(soft) < 1
        slopes = np.zeros((TF_SAMPLES + 1, len(edits)), dtype=np.float32)
        slopes[:TF_SAMPLES] = (edits * self._extinction_slopes(soft)).T
        moved = self._averages(slopes)
        changes = np.zeros_like(moved)
        for share, direction in self._lights(soft.travel):
            swept = share, *self._swept(direction)

            def follow(number: int, swept: tuple[float, Sweep, Floats, Floats] = swept) -> None:
                share, sweep, passed, clear = swept
                found = np.empty_like(passed)
                sweep_layers(sweep.layers_of(moved[number]), sweep.slope, passed, clear, found)
                changes[number] += np.float32(share) * sweep.in_place(found)

            list(self._executor.map(follow, range(len(edits))))
        changes = soft.blurred(changes * is_below)
        return self._as_grid(np.ascontiguousarray(changes.reshape(len(edits), -1).T))

    def pass_back(self, soft: SoftLight, by_light: NDArray[np.floating]) -> NDArray[np.float64]:
        """Turn a derivative by the light at each node into one by the opacity TF."""
        is_below = self._received(soft) < 1
        back = np.where(is_below, soft.blurred(by_light), 0).astype(np.float32)

        def follow(share: float, direction: NDArray[np.float64]) -> Floats:
            sweep, passed, clear = self._swept(direction)
            found = np.empty_like(passed)
            weighted = sweep.layers_of(np.float32(share) * back)
            sweep_back(weighted, sweep.slope, passed, clear, found)
            return sweep.in_place(found)

        lights = zip(*self._lights(soft.travel), strict=True)
        by_extinction = np.sum(list(self._executor.map(follow, *lights)), axis=0)
        if not self._part.is_whole:
            by_extinction *= self._shares(self._part)

        def gather(layer: int) -> NDArray[np.float64]:
            table = np.zeros(TF_SAMPLES + 1)
            add_by_level(self._levels[layer], by_extinction[layer], table)
            return table

        table = np.sum(list(self._executor.map(gather, range(len(self._levels)))), axis=0)
        return np.asarray(table[:TF_SAMPLES] * self._extinction_slopes(soft))

    def _as_grid(self, values: Floats, dim: float = 1.0) -> LightGrid:
        nz, ny, nx = self.shape
        return LightGrid(values, (nx, ny, nz), tuple(self._scale), np.float32(dim))

    def _received(self, soft: SoftLight) -> Floats:
        """Light at each node, which may be above 1."""
        scene = soft.opacities.tobytes(), soft.part
        self._part, known = soft.part, self._lit.pop(scene, None)
        if known is None:
            self._extinction = self._mean_extinction(soft)
            ambient = np.mean(list(self._executor.map(self._sweep, AROUND)), axis=0)
        else:
            self._extinction, ambient = known
        last = list(self._lit.items())[-1:]
        self._lit = dict([*last, (scene, (self._extinction, ambient))])
        return np.float32(AMBIENT) * ambient + np.float32(DISTANT) * self._sweep(soft.travel)

    def _lights(self, travel: NDArray[np.float64]) -> list[tuple[float, NDArray[np.float64]]]:
        """Strength and direction of each light, of which what is received is the sum."""
        return [(DISTANT, travel), *((AMBIENT / len(AROUND), direction) for direction in AROUND)]

    def _extinction_slopes(self, soft: SoftLight) -> NDArray[np.float64]:
        """Derivative of the extinction per world length by the TF's opacity, at each bin."""
        opacity = soft.opacities.astype(np.float64)
        slopes = soft.shadow / np.maximum(1 - opacity, 1 - NEARLY_OPAQUE) / self._volume.voxel_size
        return np.where(opacity < NEARLY_OPAQUE, slopes, 0)

    def _mean_extinction(self, soft: SoftLight) -> Floats:
        """Mean extinction per world length around each grid node."""
        opacity = np.minimum(soft.opacities.astype(np.float64), NEARLY_OPAQUE)
        # One more, of missing voxels.
        table = np.zeros((TF_SAMPLES + 1, 1), dtype=np.float32)
        table[:TF_SAMPLES, 0] = -soft.shadow * np.log1p(-opacity) / self._volume.voxel_size
        (extinction,) = self._averages(table)
        return np.asarray(extinction)

    def _averages(self, tables: Floats) -> Floats:
        """Means (m, nz, ny, nx) of tables (257, m) over the voxels around each node, as shown."""
        means = np.empty((tables.shape[1], *self.shape), dtype=np.float32)

        def average(layer: int) -> None:
            average_levels(self._levels, tables, layer, means)

        list(self._executor.map(average, range(len(self._levels))))
        return means if self._part.is_whole else means * self._shares(self._part)

    def _shares(self, part: ShownPart) -> Floats:
        """Share of the space around each node that is shown."""
        along, middles, sides = [], [], []
        for low, high, count in zip(part.crop.low, part.crop.high, self._counts, strict=True):
            places = np.arange(count)
            # Half of the space around the outermost nodes lies outside the volume.
            begin, end = np.maximum(places - 0.5, 0), np.minimum(places + 0.5, count - 1)
            inside = np.minimum(end, high * (count - 1)) - np.maximum(begin, low * (count - 1))
            along.append(np.maximum(inside, 0) / (end - begin))
            middles.append((begin + end) / 2 / (count - 1))
            sides.append((end - begin) / (count - 1))
        x, y, z = along
        shares = z[:, None, None] * y[:, None] * x
        if part.clip is not None:
            # Across the cell's steepest axis exactly, in the middle of thirds along the others.
            turns = 2 * np.array(part.clip.normal) * self._volume.proportions
            depth, widths = np.array(part.clip.offset), list[NDArray[np.float64]]()
            for axis, shape in enumerate(((1, 1, -1), (1, -1, 1), (-1, 1, 1))):
                depth = depth - turns[axis] * (middles[axis] - 0.5).reshape(shape)
                widths.append(abs(turns[axis]) * sides[axis].reshape(shape))
            one, other, steepest = sorted(widths, key=np.max)
            parts = [
                np.clip((depth + i * one + j * other) / steepest + 0.5, 0, 1)
                for i, j in itertools.product((-1 / 3, 0, 1 / 3), repeat=2)
            ]
            shares = shares * np.mean(parts, axis=0)
        return np.asarray(shares, dtype=np.float32)

    def _sweep(self, direction: NDArray[np.float64]) -> Floats:
        """Fraction of a distant light that reaches each grid node."""
        sweep, passed, _ = self._swept(direction, keeps=False)
        return sweep.in_place(passed)

    def _swept(
        self, direction: NDArray[np.float64], keeps: bool = True
    ) -> tuple[Sweep, Floats, Floats]:
        """Return a light's way, and by layers what passed to each node, and how clear it is."""
        sweep = Sweep.along(direction / self._spacing)
        layers = sweep.layers_of(self._extinction)
        passed = np.empty_like(layers)
        clear = np.empty_like(layers) if keeps else NOTHING
        sweep_layers(layers, sweep.slope, NOTHING, clear, passed)
        return sweep, passed, clear
