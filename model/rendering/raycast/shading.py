"""Light on one sample: gradient shading, or a grid of light that is already there."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from model.compilation import inlined
from model.rendering.raycast.trilinear import interpolate_inside

ZERO, ONE, TWO = np.float32(0), np.float32(1), np.float32(2)


class Light(NamedTuple):
    """A distant white light on surfaces, as VTK shades them.

    Attributes
    ----------
    travel : tuple of 3 float32
        World direction in which the light travels, of length 1.
    spacing : tuple of 3 float32
    slope : tuple of 3 float32
        What the differences between neighbouring voxels are multiplied by to
        give the normal.
    diffuse, specular, power : float32
        VTK leaves the ambient term out for a distant light; so do we.
    """

    travel: Any
    spacing: Any
    slope: Any
    diffuse: Any
    specular: Any
    power: Any


class LightGrid(NamedTuple):
    """Light that reaches each place of the volume, on a coarser grid.

    Attributes
    ----------
    grid : ndarray of float32, 1-D
        Factor of the colour, x fastest.
    shape : tuple of 3 int
    scale : tuple of 3 float32
        Grid steps per voxel along x, y and z.
    """

    grid: Any
    shape: Any
    scale: Any


@inlined
def received(glow: Any, ray: Any, k: Any) -> Any:
    """Light that reaches sample k."""
    return interpolate_inside(
        glow.grid,
        glow.shape,
        (ray.start[0] + k * ray.step[0]) * glow.scale[0],
        (ray.start[1] + k * ray.step[1]) * glow.scale[1],
        (ray.start[2] + k * ray.step[2]) * glow.scale[2],
    )


@inlined
def reflect(voxels: Any, shape: Any, light: Any, ray: Any, k: Any) -> Any:
    """Diffuse factor and white gloss of sample k; both sides of a surface are lit."""
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
        # A homogeneous region has no surface to reflect anything.
        return ZERO, ZERO
    lx, ly, lz = light.travel
    across = (nx * lx + ny * ly + nz * lz) / length
    # Mirrored about the normal, as VTK does it: on the far side with the sign left out.
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
