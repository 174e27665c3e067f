"""Shading of one sample: gradient shading, or look-up of precomputed light."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from model.compilation import called, inlined
from model.rendering.raycast.trilinear import clamp, interpolate_inside, locate, nearest_of

ZERO, HALF, ONE, TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)


class Light(NamedTuple):
    """Parameters of gradient shading by a distant white light, as in VTK."""

    travel: Any  # tuple of 3 float32: unit vector in world coordinates in which the light travels
    spacing: Any  # tuple of 3 float32: voxel spacing along x, y and z
    slope: Any
    """Tuple of 3 float32: factors that convert differences between voxels to the gradient."""
    diffuse: Any
    specular: Any  # float32: coefficients; like VTK, there is no ambient term for a distant light
    power: Any  # int: of the gloss; even
    low: Any
    high: Any
    """Tuple of 3 float32: least and greatest corner of what is shown, in voxels: its faces are
    surfaces, too."""
    plane: Any
    """Tuple of 4 float32: the clipping plane, another face, in voxels; see
    :meth:`model.scene.clip_plane.ShownPart.plane`."""
    normal: Any  # tuple of 3 float32: the clipping plane's normal in world coordinates
    noise: Any
    """Float32: fourth power of the gradient, in differences of voxels, at which its direction
    counts for a half; 0 where every one counts."""
    dim: Any
    """Float32: how bright the image can be, 0 to 1, see
    :meth:`model.rendering.raycast.renderer.RaycastRenderer`: in a faint one fainter samples
    count."""
    shines: Any
    """Bool: whether there is this light; some kernels take one of the same type where there is
    none."""


class LightGrid(NamedTuple):
    """Light that reaches the points of the volume, on a coarse grid."""

    grid: Any
    """Float32, 1-D: factors of the colour, in [0, 1], x fastest; empty where there is no such
    light."""
    shape: Any  # tuple of 3 int: number of grid nodes along x, y and z
    scale: Any  # tuple of 3 float32: grid steps per voxel along x, y and z
    dim: Any


_NOWHERE = (ZERO, ZERO, ZERO)
_PLANE = (ZERO, ZERO, ZERO, ZERO)
NO_LIGHT = Light(
    _NOWHERE, _NOWHERE, _NOWHERE, ZERO, ZERO, 0, _NOWHERE, _NOWHERE, _PLANE, _NOWHERE, ZERO, ONE,
    False,
)  # fmt: skip
NO_GRID = LightGrid(np.empty(0, dtype=np.float32), (0, 0, 0), _NOWHERE, ONE)
"""Given to kernels in place of a light that a scene does not have."""


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
def light_place(glow: Any, ray: Any, k: Any) -> Any:
    """Return the node of the light's grid before sample k, and the weights of the next ones."""
    return locate(
        glow.shape,
        clamp((ray.start[0] + k * ray.step[0]) * glow.scale[0], glow.shape[0]),
        clamp((ray.start[1] + k * ray.step[1]) * glow.scale[1], glow.shape[1]),
        clamp((ray.start[2] + k * ray.step[2]) * glow.scale[2], glow.shape[2]),
    )


@inlined
def corner_of(glow: Any, place: Any, fx: Any, fy: Any, fz: Any, corner: int) -> Any:
    """Return one of the eight nodes around a place, and its weight there."""
    right, above, behind = corner & 1, (corner >> 1) & 1, corner >> 2
    share = fx if right else ONE - fx
    share *= fy if above else ONE - fy
    share *= fz if behind else ONE - fz
    at = place + np.uint64(right) + np.uint64(above) * np.uint64(glow.shape[0])
    return at + np.uint64(behind) * np.uint64(glow.shape[0] * glow.shape[1]), share


@inlined
def reflect(medium: Any, light: Any, ray: Any, k: Any) -> Any:
    """Diffuse factor and white gloss of sample k; both sides of a surface are lit.

    The gradient gives the normal, as far as it is more than noise: where it is not, the sample is
    lit evenly. Within half a voxel of a face of what is shown, the face's normal counts instead,
    and less and less up to a voxel.
    """
    x = ray.start[0] + k * ray.step[0]
    y = ray.start[1] + k * ray.step[1]
    z = ray.start[2] + k * ray.step[2]
    nx, ny, nz = gradient(medium, x, y, z)
    change = nx * nx + ny * ny + nz * nz
    change *= change
    diffuse, gloss = HALF * light.diffuse, ZERO
    if change > ZERO:
        nx, ny, nz = nx * light.slope[0], ny * light.slope[1], nz * light.slope[2]
        diffuse, gloss = mirror(light, ray, nx, ny, nz)
        if light.noise > ZERO:
            share = change / (change + light.noise)
            even = HALF * light.diffuse
            diffuse = even + share * (diffuse - even)
            gloss *= share
    low, high = light.low, light.high
    bx = min(x - low[0], high[0] - x)
    by = min(y - low[1], high[1] - y)
    bz = min(z - low[2], high[2] - z)
    bn = depth_below(light.plane, x, y, z)
    if min(min(bx, bn), min(by, bz)) < ONE:
        return _by_faces(light, ray, (bx, by, bz, bn), diffuse, gloss)
    return diffuse, gloss


@called
def _by_faces(light: Any, ray: Any, depths: Any, diffuse: Any, gloss: Any) -> Any:
    """Diffuse factor and gloss of a sample next to faces of what is shown."""
    bx, by, bz, bn = depths
    bx, by, bz, bn = nearness(bx), nearness(by), nearness(bz), nearness(bn)
    nx, ny, nz = light.normal
    lx, ly, lz = light.travel
    vx, vy, vz = (
        ray.step[0] * light.spacing[0],
        ray.step[1] * light.spacing[1],
        ray.step[2] * light.spacing[2],
    )
    total, share = bx + by + bz + bn, max(max(bx, bn), max(by, bz))
    across = nx * lx + ny * ly + nz * lz
    flat = (bx * abs(lx) + by * abs(ly) + bz * abs(lz) + bn * abs(across)) * light.diffuse
    # The light mirrored by a face has its component along the axis, and minus the others.
    passing = lx * vx + ly * vy + lz * vz
    length = vx * vx + vy * vy + vz * vz
    shine = bx * highlight(TWO * lx * vx - passing, length, light.power)
    shine += by * highlight(TWO * ly * vy - passing, length, light.power)
    shine += bz * highlight(TWO * lz * vz - passing, length, light.power)
    along = TWO * across * (nx * vx + ny * vy + nz * vz) - passing
    shine += bn * highlight(along, length, light.power)
    diffuse += share * (flat / total - diffuse)
    gloss += share * (light.specular * shine / total - gloss)
    return diffuse, gloss


@inlined
def depth_below(plane: Any, x: Any, y: Any, z: Any) -> Any:
    """Return how many voxels a place is behind a clipping plane, on the side that is shown."""
    return plane[3] - (plane[0] * x + plane[1] * y + plane[2] * z)


@inlined
def nearness(depth: Any) -> Any:
    """Return how much a face counts so many voxels behind it: 1 up to a half, 0 from one on."""
    return min(max(TWO - TWO * depth, ZERO), ONE)


@inlined
def highlight(along: Any, square: Any, power: int) -> Any:
    """Return a power of the cosine of two directions, from their product and squared lengths."""
    return half_power(along * along / square, power) if along > ZERO else ZERO


@inlined
def mirror(light: Any, ray: Any, nx: Any, ny: Any, nz: Any) -> Any:
    """Diffuse factor and white gloss of a surface with a normal, of any length above 0."""
    square = nx * nx + ny * ny + nz * nz
    inverse = ONE / math.sqrt(square)
    lx, ly, lz = light.travel
    across = (nx * lx + ny * ly + nz * lz) * inverse
    # Mirrored about the normal, as VTK does it: on the far side with the sign left out.
    twice = TWO * abs(across) * inverse
    mx, my, mz = twice * nx - lx, twice * ny - ly, twice * nz - lz
    vx, vy, vz = (
        ray.step[0] * light.spacing[0],
        ray.step[1] * light.spacing[1],
        ray.step[2] * light.spacing[2],
    )
    along = mx * vx + my * vy + mz * vz
    if not along > ZERO:
        return light.diffuse * abs(across), ZERO
    # On the far side the mirrored direction is longer than 1.
    along *= along / ((mx * mx + my * my + mz * mz) * (vx * vx + vy * vy + vz * vz))
    return light.diffuse * abs(across), light.specular * half_power(along, light.power)


@inlined
def half_power(square: Any, power: int) -> Any:
    """Return a number to an even power, from its square, by few multiplications."""
    result, rest = ONE, power >> 1
    while rest > 0:
        if rest & 1:
            result *= square
        square *= square
        rest >>= 1
    return result


@inlined
def gradient(medium: Any, x: Any, y: Any, z: Any) -> Any:
    """Interpolate the differences between the next and the previous voxel along each axis.

    That is the same as the difference of the field interpolated a voxel further and a voxel
    back, with positions outside clamped to the faces, but shares rows of voxels. Of labels, whose
    differences mean nothing, it is :func:`_towards_own`.
    """
    voxels, shape = medium.voxels, medium.shape
    if medium.is_nearest:
        return _towards_own(voxels, shape, x, y, z)
    inner = x >= ONE and y >= ONE and z >= ONE
    inner = inner and x < np.float32(shape[0] - 2) and y < np.float32(shape[1] - 2)
    if not (inner and z < np.float32(shape[2] - 2)):
        gx = interpolate_inside(voxels, shape, x + ONE, y, z)
        gx -= interpolate_inside(voxels, shape, x - ONE, y, z)
        gy = interpolate_inside(voxels, shape, x, y + ONE, z)
        gy -= interpolate_inside(voxels, shape, x, y - ONE, z)
        gz = interpolate_inside(voxels, shape, x, y, z + ONE)
        gz -= interpolate_inside(voxels, shape, x, y, z - ONE)
        return gx, gy, gz
    place, fx, fy, fz = locate(shape, x, y, z)
    row, layer = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
    # In the nearest row, the next row, the next layer, and the next row of that one.
    slope0, value0 = _along_x(voxels, place, fx)
    slope1, value1 = _along_x(voxels, place + row, fx)
    slope2, value2 = _along_x(voxels, place + layer, fx)
    slope3, value3 = _along_x(voxels, place + layer + row, fx)
    near = slope0 + fy * (slope1 - slope0)
    gx = near + fz * (slope2 + fy * (slope3 - slope2) - near)
    near = _change(
        _pair(voxels, place - row, fx), value0, value1, _pair(voxels, place + row + row, fx), fy
    )
    far = _change(
        _pair(voxels, place + layer - row, fx),
        value2,
        value3,
        _pair(voxels, place + layer + row + row, fx),
        fy,
    )
    gy = near + fz * (far - near)
    near = _change(
        _pair(voxels, place - layer, fx),
        value0,
        value2,
        _pair(voxels, place + layer + layer, fx),
        fz,
    )
    far = _change(
        _pair(voxels, place + row - layer, fx),
        value1,
        value3,
        _pair(voxels, place + row + layer + layer, fx),
        fz,
    )
    gz = near + fy * (far - near)
    return gx, gy, gz


@inlined
def _along_x(voxels: Any, place: Any, fx: Any) -> Any:
    """Interpolated difference along x within a row, and the row's interpolated value."""
    before = np.float32(voxels[place - np.uint64(1)])
    first = np.float32(voxels[place])
    second = np.float32(voxels[place + np.uint64(1)])
    behind = np.float32(voxels[place + np.uint64(2)])
    return _change(before, first, second, behind, fx), first + fx * (second - first)


@inlined
def _pair(voxels: Any, place: Any, fx: Any) -> Any:
    first = np.float32(voxels[place])
    return first + fx * (np.float32(voxels[place + np.uint64(1)]) - first)


@inlined
def _change(before: Any, first: Any, second: Any, behind: Any, share: Any) -> Any:
    """Interpolate between the central differences at the inner two of four values."""
    change = second - before
    return change + share * (behind - first - change)


@called
def _towards_own(voxels: Any, shape: Any, x: Any, y: Any, z: Any) -> Any:
    """Gradient of the share of the nearest voxel's label among the 64 around.

    They are weighted by a cubic B-spline, so that a staircase of voxels is a smooth surface. It
    does not depend on the TF, as the derivatives by it demand.
    """
    x, y, z = clamp(x, shape[0]), clamp(y, shape[1]), clamp(z, shape[2])
    place, fx, fy, fz = locate(shape, x, y, z)
    own = voxels[nearest_of(shape, place, fx, fy, fz)]
    i, j, k = np.int32(x), np.int32(y), np.int32(z)
    gx, gy, gz = ZERO, ZERO, ZERO
    for n in range(16):
        b, c = j - 1 + (n & 3), k - 1 + (n >> 2)
        wy, dy = _spline(y - np.float32(b))
        wz, dz = _spline(z - np.float32(c))
        row = shape[0] * (min(max(b, 0), shape[1] - 1) + shape[1] * min(max(c, 0), shape[2] - 1))
        share, change = ZERO, ZERO
        for a in range(i - 1, i + 3):
            if voxels[np.uint64(row + min(max(a, 0), shape[0] - 1))] == own:
                wx, dx = _spline(x - np.float32(a))
                share += wx
                change += dx
        gx += change * wy * wz
        gy += share * dy * wz
        gz += share * wy * dz
    return gx, gy, gz


@inlined
def _spline(u: Any) -> Any:
    """Cubic B-spline at a distance of up to 2, and its derivative."""
    t = abs(u)
    if t < ONE:
        return np.float32(2 / 3) - t * t + HALF * t * t * t, u * (np.float32(1.5) * t - TWO)
    rest = TWO - t
    slope = -HALF * rest * rest
    return rest * rest * rest / np.float32(6), slope if u > ZERO else -slope
