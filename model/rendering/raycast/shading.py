"""Shading of one sample: gradient shading, or look-up of precomputed light."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from model.compilation import inlined
from model.rendering.raycast.trilinear import interpolate_inside

ZERO, ONE, TWO = np.float32(0), np.float32(1), np.float32(2)


class Light(NamedTuple):
    """Parameters of gradient shading by a distant white light, as in VTK.

    Attributes
    ----------
    travel : tuple of 3 float32
        Unit vector in world coordinates in which the light travels.
    spacing : tuple of 3 float32
        Voxel spacing along x, y and z.
    slope : tuple of 3 float32
        Factors that convert differences between voxels to the gradient.
    diffuse, specular, power : float32
        Coefficients; like VTK, there is no ambient term for a distant light.
    """

    travel: Any
    spacing: Any
    slope: Any
    diffuse: Any
    specular: Any
    power: Any


class LightGrid(NamedTuple):
    """Light that reaches the points of the volume, on a coarse grid.

    Attributes
    ----------
    grid : ndarray of float32, 1-D
        Factors of the colour, in [0, 1], x fastest.
    shape : tuple of 3 int
        Number of grid nodes along x, y and z.
    scale : tuple of 3 float32
        Grid steps per voxel along x, y and z.
    """

    grid: Any
    shape: Any
    scale: Any


@inlined
def received(glow: Any, ray: Any, k: Any) -> Any:
    """Return the light that reaches sample k."""
    return interpolate_inside(
        glow.grid,
        glow.shape,
        (ray.start[0] + k * ray.step[0]) * glow.scale[0],
        (ray.start[1] + k * ray.step[1]) * glow.scale[1],
        (ray.start[2] + k * ray.step[2]) * glow.scale[2],
    )


@inlined
def reflect(voxels: Any, shape: Any, light: Any, ray: Any, k: Any) -> Any:
    """Return the diffuse factor and white specular term of sample k, with two-sided lighting."""
    x = ray.start[0] + k * ray.step[0]
    y = ray.start[1] + k * ray.step[1]
    z = ray.start[2] + k * ray.step[2]
    nx = interpolate_inside(voxels, shape, x + ONE, y, z)
    nx = (nx - interpolate_inside(voxels, shape, x - ONE, y, z)) * light.slope[0]
    ny = interpolate_inside(voxels, shape, x, y + ONE, z)
    ny = (ny - interpolate_inside(voxels, shape, x, y - ONE, z)) * light.slope[1]
    nz = interpolate_inside(voxels, shape, x, y, z + ONE)
    nz = (nz - interpolate_inside(voxels, shape, x, y, z - ONE)) * light.slope[2]
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > ZERO:
        # A homogeneous region has no surface normal.
        return ZERO, ZERO
    lx, ly, lz = light.travel
    across = (nx * lx + ny * ly + nz * lz) / length
    # Mirrored about the normal as in VTK, which ignores the sign on the far side.
    twice = TWO * abs(across) / length
    mx, my, mz = twice * nx - lx, twice * ny - ly, twice * nz - lz
    vx, vy, vz = (
        ray.step[0] * light.spacing[0],
        ray.step[1] * light.spacing[1],
        ray.step[2] * light.spacing[2],
    )
    # On the far side the mirrored direction is longer than 1.
    square = (mx * mx + my * my + mz * mz) * (vx * vx + vy * vy + vz * vz)
    along = (mx * vx + my * vy + mz * vz) / math.sqrt(square)
    gloss = light.specular * along**light.power if along > ZERO else ZERO
    return light.diffuse * abs(across), gloss
