"""Tracking: where a ray through the volume collides, and its transmittance.

Each cell has a majorant, its greatest extinction, with which collisions are drawn. A collision is
real with probability extinction / majorant (delta tracking). The transmittance is the product of 1
minus this ratio (ratio tracking). Both are unbiased. Positions are in voxels; lengths along a ray
are in voxel sizes, the reference length of opacities.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from model.compilation import inlined
from model.rendering.path_tracing.random_numbers import following, hashed, number_of
from model.rendering.raycast.batch import HALF, faded, level_of
from model.rendering.raycast.cells import MinMaxCells
from model.rendering.raycast.classification import LEVELS, LEVELS_PER_BIN
from model.rendering.raycast.rays import HUGE, ONE, ZERO, dot, inverse_step, times
from model.rendering.raycast.shading import depth_below
from model.rendering.raycast.trilinear import (
    clamp,
    hidden_share,
    locate,
    nearest_of,
    smoothed,
    value_at,
)

ADVANCE = np.float32(1e-3)
"""Least step from cell to cell, in voxel sizes; otherwise rounding could stop a ray."""

DIM = np.float32(0.1)
"""Transmittance below which tracking ends at random; surviving rays get more weight."""

FAINTEST = np.float32(1e-20)
"""Extinction that counts as none. The reciprocal of a smaller one may be infinite, and its product
with a depth of 0 no number."""

CLEAREST = np.float32(0.01)
"""Least transparency of half a voxel, so that extinction is finite: one part in 10,000 a voxel."""


class Scatterer(NamedTuple):
    """A volume that scatters light under an opacity TF."""

    medium: Any  # Medium: what view rays read; its cells' distances are of extinction
    majorants: Any  # float32, 1-D: greatest extinction in each cell, per voxel size
    extinctions: Any  # float32, 1-D: extinction at each level, per voxel size
    faces: Any  # Faces
    scaling: Any  # tuple of 3 float32: voxels per voxel size along each axis


@inlined
def level_at(medium, x, y, z):
    """Return the level of the tables at a place inside the volume."""
    voxels, shape = medium.voxels, medium.shape
    place, weights = locate(shape, x, y, z)
    if medium.is_nearest:
        value = np.float32(voxels[nearest_of(shape, place, weights)])
    else:
        value = smoothed(medium, value_at(voxels, shape, place, weights), x, y, z)
    level = level_of(value, medium.scale)
    if len(medium.missing) > 0:
        share = hidden_share(medium.missing, shape, medium.is_nearest, place, weights)
        level = faded(level, share)
    return level


@inlined
def track(scatterer, place, direction, state, transmits):
    """Follow a ray from a place in what is shown to its next collision, or to its end."""
    x, y, z = place
    medium = scatterer.medium
    away = times(direction, scatterer.scaling)
    dx, dy, dz = away
    ix, iy, iz = inverse_step(dx), inverse_step(dy), inverse_step(dz)
    low, high, plane = scatterer.faces.low, scatterer.faces.high, scatterer.faces.plane
    end = min(
        ((high[0] if dx >= ZERO else low[0]) - x) * ix,
        min(
            ((high[1] if dy >= ZERO else low[1]) - y) * iy,
            ((high[2] if dz >= ZERO else low[2]) - z) * iz,
        ),
    )
    leaving = dot(plane, away)
    if leaving > ZERO:
        end = min(end, depth_below(plane, x, y, z) / leaving)
    through, t = ONE, ZERO
    depth: Any = -ONE
    while t < end:
        # A little ahead, as rounding may put a place at a face on either side of it.
        ahead = t + ADVANCE
        cx = int(clamp(x + ahead * dx, medium.shape[0])) >> medium.shift
        cy = int(clamp(y + ahead * dy, medium.shape[1])) >> medium.shift
        cz = int(clamp(z + ahead * dz, medium.shape[2])) >> medium.shift
        cx = min(cx, medium.cell_shape[0] - 1)
        cy = min(cy, medium.cell_shape[1] - 1)
        cz = min(cz, medium.cell_shape[2] - 1)
        cell = np.uint64(cx + medium.cell_shape[0] * (cy + medium.cell_shape[1] * cz))
        wide = max(int(medium.cells[cell]), 1)
        fx = np.float32(((cx + wide) if dx >= ZERO else (cx - wide + 1)) << medium.shift)
        fy = np.float32(((cy + wide) if dy >= ZERO else (cy - wide + 1)) << medium.shift)
        fz = np.float32(((cz + wide) if dz >= ZERO else (cz - wide + 1)) << medium.shift)
        face = min((fx - x) * ix, min((fy - y) * iy, (fz - z) * iz))
        face = min(max(face, ahead), end)
        majorant = scatterer.majorants[cell]
        if majorant <= FAINTEST:
            t = face
            continue
        scarcity = ONE / majorant
        while True:
            if depth < ZERO:
                state = following(state)
                depth = -math.log(ONE - number_of(hashed(state)))
            step = depth * scarcity
            if t + step >= face:
                depth -= (face - t) * majorant
                depth = max(depth, ZERO)
                t = face
                break
            t += step
            depth = -ONE
            level = level_at(
                medium,
                clamp(x + t * dx, medium.shape[0]),
                clamp(y + t * dy, medium.shape[1]),
                clamp(z + t * dz, medium.shape[2]),
            )
            share = scatterer.extinctions[np.uint64(np.uint32(level))] * scarcity
            if transmits:
                through *= ONE - min(share, ONE)
                if through <= ZERO:
                    return np.int32(-1), t, ZERO
                if through < DIM:
                    state = following(state)
                    if number_of(hashed(state)) >= HALF:
                        return np.int32(-1), t, ZERO
                    through += through
            else:
                state = following(state)
                if number_of(hashed(state)) < share:
                    return np.int32(level), t, ONE
    return np.int32(-1), min(t, HUGE), through


class Extinction(NamedTuple):
    """A volume's extinction under one opacity TF."""

    levels: NDArray[np.float32]  # per voxel size, at each level of scalar values
    majorants: NDArray[np.float32]  # greatest extinction in each cell
    cells: NDArray[np.int8]  # distance of each cell to the nearest one where something is visible

    @classmethod
    def of(cls, opacity: NDArray[np.float32], distance: float, cells: MinMaxCells) -> Extinction:
        """Return the extinction, given the opacity of samples some distance apart."""
        levels = -np.log1p(-np.minimum(opacity, 1 - CLEAREST)) / distance
        in_bin = levels[:LEVELS:LEVELS_PER_BIN]
        shown = cells.distances(_touched(in_bin))
        return cls(levels.astype(np.float32), cells.greatest(in_bin), shown)

    def of_splines(self, shape: tuple[int, int, int]) -> Extinction:
        """Return the extinction for cubic B-splines, in which voxels next to a cell count, too.

        Adjacent cells have common voxels, so that all between both's values is in one of them.
        """
        wide = maximum_filter(self.majorants.reshape(shape[::-1]), 3)
        return Extinction(self.levels, wide.ravel(), np.maximum(self.cells - 1, 0))


def _touched(values: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which bins are visible, or next to a visible one: values between both are, too."""
    shown = values > 0
    wide = shown.copy()
    wide[1:] |= shown[:-1]
    wide[:-1] |= shown[1:]
    return wide
