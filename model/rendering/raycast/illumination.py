"""Illumination: a scene's light as kernels take it, by gradient shading or from a grid.

Soft light follows the paper (section 6): one distant light and ambient light, attenuated by the
volume's extinction. The light that reaches each point, from the distant light and from all
directions, is computed by sweeps over a coarse grid of the extinction.
"""

from __future__ import annotations

import itertools
from concurrent.futures import Executor
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from model.rendering.opacity_correction import NEARLY_OPAQUE
from model.rendering.raycast.classification import Classification
from model.rendering.raycast.light_sweeps import (
    NODE_LEVELS,
    Sweep,
    add_by_level,
    average_levels,
    look_around,
    sweep_back,
    sweep_change,
    sweep_layers,
)
from model.rendering.raycast.shading import NO_GRID, NO_LIGHT, Light, LightGrid
from model.rendering.scalars import LABEL_NOISE, noise_of
from model.scene.clip_plane import WHOLE_PART, ShownPart
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection, Lighting
from model.scene.transfer_function import TF_SAMPLES
from model.scene.view import View
from model.scene.volume import Volume

DIFFUSE, SPECULAR, POWER = 0.9, 0.2, 20
"""Coefficients of gradient shading, equal to the reference renderer's."""

NOISE = 3.0
"""Gradient, in the noise's standard deviations, from which on a surface is rather seen than not.

The difference of two voxels has 1.4 of them along each axis, less between voxels."""

AMBIENT, DISTANT = 0.4, 0.65  # soft light: unoccluded ambient light and distant light
LONGEST_AXIS = 64  # nodes along the longest axis of the light grid

NO_CLEARNESS = np.empty((0, 0, 0), dtype=np.float32)
"""Given to a sweep whose transparencies are not asked for."""

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
    volume: Volume,
    part: ShownPart = WHOLE_PART,
    noise: float = 0.0,
    dim: float = 1.0,
) -> Light:
    """Return the parameters of gradient shading for a view and its light."""
    low, high = part.corners(volume)
    return Light(
        tuple(map(np.float32, travel_direction(view, light))),
        tuple(map(np.float32, volume.spacing)),
        tuple(np.float32(1 / s) for s in volume.spacing),
        np.float32(DIFFUSE),
        np.float32(SPECULAR),
        POWER,
        tuple(map(np.float32, low)),
        tuple(map(np.float32, high)),
        tuple(map(np.float32, part.plane(volume))),
        tuple(map(np.float32, part.normal)),
        np.float32((NOISE * noise) ** 4),
        np.float32(dim),
        True,
    )


class Illumination:
    """Light that reaches the points of a volume, on a coarse grid.

    Extinction and ambient light depend on the opacity TF only and are cached while
    the view changes, for two TFs that take turns. The distant light moves with the view;
    its shadows are recomputed for each view, by one sweep.
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
        self._lit: dict[tuple[bytes, ShownPart], tuple[NDArray[np.float32], ...]] = {}
        self._part = WHOLE_PART

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes along z, y and x."""
        nx, ny, nz = map(int, self._counts)
        return nz, ny, nx

    def grid(
        self,
        view: View,
        light: LightDirection,
        opacities: NDArray[np.float32],
        part: ShownPart = WHOLE_PART,
        dim: float = 1.0,
    ) -> LightGrid:
        """Compute the light for a view, a light direction and the opacity TF's 256 samples.

        What is not shown casts no shadow; for `dim` see
        :class:`model.rendering.raycast.shading.Light`.
        """
        received = self._received(view, light, opacities, part)
        # Light above 1 would exceed the colour range.
        return self._as_grid(np.minimum(received, 1).reshape(-1), dim)

    def changes(
        self,
        view: View,
        light: LightDirection,
        opacities: NDArray[np.float32],
        edits: NDArray[np.float32],
        part: ShownPart = WHOLE_PART,
    ) -> LightGrid:
        """Compute the change of the light at each node per unit of edits of the opacity TF."""
        is_below = self._received(view, light, opacities, part) < 1
        slopes = np.zeros((TF_SAMPLES + 1, len(edits)), dtype=np.float32)
        slopes[:TF_SAMPLES] = (edits * self._extinction_slopes(opacities)).T
        moved = self._averages(slopes)
        if not self._part.is_whole:
            moved *= self._shares(self._part)
        changes = np.zeros_like(moved)
        for share, direction in self._lights(view, light):
            sweep = self._course(direction)
            layers = sweep.layers_of(self._extinction)
            passed, clear = (np.empty_like(layers) for _ in range(2))
            sweep_layers(layers, sweep.slope, passed, clear)

            def follow(
                number: int,
                share: float = share,
                sweep: Sweep = sweep,
                passed: NDArray[np.float32] = passed,
                clear: NDArray[np.float32] = clear,
            ) -> None:
                found = np.empty_like(passed)
                sweep_change(sweep.layers_of(moved[number]), sweep.slope, passed, clear, found)
                changes[number] += np.float32(share) * sweep.in_place(found)

            list(self._executor.map(follow, range(len(edits))))
        changes *= is_below
        return self._as_grid(np.ascontiguousarray(changes.reshape(len(edits), -1).T))

    def pass_back(
        self,
        view: View,
        light: LightDirection,
        opacities: NDArray[np.float32],
        by_light: NDArray[np.floating],
        part: ShownPart = WHOLE_PART,
    ) -> NDArray[np.float64]:
        """Turn a derivative by the light at each node into one by the opacity TF."""
        is_below = self._received(view, light, opacities, part) < 1
        back = np.where(is_below, by_light, 0).astype(np.float32)

        def follow(share: float, direction: NDArray[np.float64]) -> NDArray[np.float32]:
            sweep = self._course(direction)
            layers = sweep.layers_of(self._extinction)
            passed, clear, found = (np.empty_like(layers) for _ in range(3))
            sweep_layers(layers, sweep.slope, passed, clear)
            weighted = sweep.layers_of(np.float32(share) * back)
            sweep_back(weighted, sweep.slope, passed, clear, found)
            return sweep.in_place(found)

        by_extinction = np.sum(
            list(self._executor.map(follow, *zip(*self._lights(view, light), strict=True))), axis=0
        )
        if not self._part.is_whole:
            by_extinction *= self._shares(self._part)

        def gather(layer: int) -> NDArray[np.float64]:
            table = np.zeros(TF_SAMPLES + 1)
            add_by_level(self._levels[layer], by_extinction[layer], table)
            return table

        table = np.sum(list(self._executor.map(gather, range(len(self._levels)))), axis=0)
        return np.asarray(table[:TF_SAMPLES] * self._extinction_slopes(opacities))

    def _as_grid(self, values: NDArray[np.float32], dim: float = 1.0) -> LightGrid:
        nz, ny, nx = self.shape
        sx, sy, sz = self._scale
        return LightGrid(values, (nx, ny, nz), (sx, sy, sz), np.float32(dim))

    def _received(
        self,
        view: View,
        light: LightDirection,
        opacities: NDArray[np.float32],
        part: ShownPart,
    ) -> NDArray[np.float32]:
        """Light at each node, which may be above 1."""
        scene = opacities.tobytes(), part
        self._part, known = part, self._lit.pop(scene, None)
        if known is None:
            self._extinction = self._mean_extinction(opacities)
            ambient = np.mean(list(self._executor.map(self._sweep, AROUND)), axis=0)
        else:
            self._extinction, ambient = known
        last = list(self._lit.items())[-1:]
        self._lit = dict([*last, (scene, (self._extinction, ambient))])
        distant = self._sweep(travel_direction(view, light))
        return np.float32(AMBIENT) * ambient + np.float32(DISTANT) * distant

    def _lights(self, view: View, light: LightDirection) -> list[tuple[float, NDArray[np.float64]]]:
        """Strength and direction of each light, of which what is received is the sum."""
        around = [(AMBIENT / len(AROUND), direction) for direction in AROUND]
        return [(DISTANT, travel_direction(view, light)), *around]

    def _extinction_slopes(self, opacities: NDArray[np.float32]) -> NDArray[np.float64]:
        """Derivative of the extinction per world length by the TF's opacity, at each bin."""
        opacity = opacities.astype(np.float64)
        slopes = 1 / np.maximum(1 - opacity, 1 - NEARLY_OPAQUE) / self._volume.voxel_size
        return np.where(opacity < NEARLY_OPAQUE, slopes, 0)

    def _mean_extinction(self, opacities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Mean extinction per world length around each grid node."""
        opacity = np.minimum(opacities.astype(np.float64), NEARLY_OPAQUE)
        # One more, of missing voxels.
        table = np.zeros((TF_SAMPLES + 1, 1), dtype=np.float32)
        table[:TF_SAMPLES, 0] = -np.log1p(-opacity) / self._volume.voxel_size
        (extinction,) = self._averages(table)
        return extinction if self._part.is_whole else extinction * self._shares(self._part)

    def _averages(self, tables: NDArray[np.float32]) -> NDArray[np.float32]:
        """Means (m, nz, ny, nx) of tables (257, m) over the voxels around each node."""
        means = np.empty((tables.shape[1], *self.shape), dtype=np.float32)

        def average(layer: int) -> None:
            average_levels(self._levels, tables, layer, means)

        list(self._executor.map(average, range(len(self._levels))))
        return means

    def _shares(self, part: ShownPart) -> NDArray[np.float32]:
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

    def _sweep(self, direction: NDArray[np.float64]) -> NDArray[np.float32]:
        """Fraction of a distant light that reaches each grid node."""
        sweep = self._course(direction)
        extinction = sweep.layers_of(self._extinction)
        transmitted = np.empty_like(extinction)
        sweep_layers(extinction, sweep.slope, transmitted, NO_CLEARNESS)
        return sweep.in_place(transmitted)

    def _course(self, direction: NDArray[np.float64]) -> Sweep:
        return Sweep.along(direction / self._spacing)


COARSE = 32  # nodes along the longest axis of a coarse grid of soft light


class Lit(NamedTuple):
    """A scene's light."""

    gradient: Light | None  # of surfaces by their gradient; None where they reflect nothing
    soft: LightGrid | None  # soft light at the nodes of a grid; None under another one

    @property
    def filled(self) -> tuple[Light, LightGrid]:
        """The same for kernels that one version of serves all lights."""
        return self.gradient or NO_LIGHT, self.soft or NO_GRID


UNLIT = Lit(None, None)


class SceneLight:
    """Lights the scenes of one volume; from a coarse grid where `is_coarse`, as for what moves."""

    def __init__(
        self,
        volume: Volume,
        scalars: NDArray[np.generic],
        lighting: Lighting,
        default: LightDirection,
        light_grid: partial[Illumination],
    ) -> None:
        self._volume, self._lighting, self._default = volume, lighting, default
        self._noise = noise_of(scalars) if lighting == "direct" else 0.0
        self._grid = light_grid() if lighting == "soft" else None
        self.is_coarse = False
        self.coarse_grid = lru_cache(lambda: light_grid(longest=COARSE))

    @property
    def grid(self) -> Illumination | None:
        """The grid of soft light; None under another one."""
        return self.coarse_grid() if self._grid is not None and self.is_coarse else self._grid

    def of(self, inputs: SceneInputs, classification: Classification) -> Lit:
        """Return the light of a scene."""
        light = inputs.light or self._default
        gradient, soft = None, None
        if self._lighting == "direct":
            noise = LABEL_NOISE if inputs.is_nearest(self._volume) else self._noise
            gradient = gradient_light(
                inputs.view, light, self._volume, inputs.part, noise, classification.brightest
            )
        if self.grid is not None:
            soft = self.grid.grid(*self.soft_inputs(inputs), inputs.part, classification.brightest)
        return Lit(gradient, soft)

    def soft_inputs(self, inputs: SceneInputs) -> tuple[View, LightDirection, NDArray[np.float32]]:
        """Return what soft light depends on but the shown part: view, light and opacities."""
        opacities = inputs.opacity_tf.sample(self._volume.scalar_range)
        return inputs.view, inputs.light or self._default, opacities
