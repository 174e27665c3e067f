"""Shading of one sample: gradient shading, or look-up of precomputed light."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from model.compilation import called, inlined
from model.rendering.raycast.rays import ONE, ZERO, dot, place_on, times
from model.rendering.raycast.trilinear import HALF, clamp, locate, nearest_of, spline, value_at
from model.scene.clip_plane import ShownPart
from model.scene.volume import Volume

TWO = np.float32(2)


class Faces(NamedTuple):
    """Faces of what is shown, which are surfaces, too."""

    low: Any
    high: Any  # tuples of 3 float32: least and greatest corner, in voxels
    plane: Any  # tuple of 4 float32: the clipping plane in voxels, see `ShownPart.plane`
    normal: Any  # tuple of 3 float32: its normal in world coordinates


class Light(NamedTuple):
    """Parameters of gradient shading by a distant white light, as in VTK."""

    travel: Any  # tuple of 3 float32: unit vector in world coordinates in which the light travels
    spacing: Any  # tuple of 3 float32: voxel spacing along x, y and z
    slope: Any  # tuple of 3 float32: factors from differences between voxels to the gradient
    diffuse: Any
    specular: Any  # float32: coefficients; like VTK, there is no ambient term for a distant light
    power: Any  # int: of the gloss; even
    faces: Any  # Faces
    noise: Any
    """Float32: fourth power of the gradient, in differences of voxels, at which the normal has
    half its weight; 0 if all normals count."""
    dim: Any  # float32: largest brightness of the image, 0 to 1, to which thresholds are relative
    shines: Any  # bool: whether there is this light, where kernels take one in any case


class LightGrid(NamedTuple):
    """Light that reaches the points of the volume, on a coarse grid."""

    grid: Any  # float32, 1-D: factors of the colour, in [0, 1], x fastest; empty without such light
    shape: Any  # tuple of 3 int: number of grid nodes along x, y and z
    scale: Any  # tuple of 3 float32: grid steps per voxel along x, y and z
    dim: Any  # as of Light


_NOWHERE = (ZERO, ZERO, ZERO)
_FACELESS = Faces(_NOWHERE, _NOWHERE, (ZERO, ZERO, ZERO, ZERO), _NOWHERE)
NO_LIGHT = Light(_NOWHERE, _NOWHERE, _NOWHERE, ZERO, ZERO, 0, _FACELESS, ZERO, ONE, False)
NO_GRID = LightGrid(np.empty(0, dtype=np.float32), (0, 0, 0), _NOWHERE, ONE)
"""Arguments of kernels for a light that a scene does not have."""


def faces_of(part: ShownPart, volume: Volume) -> Faces:
    """Return the faces of what is shown of a volume."""
    low, high = part.corners(volume)
    ends = low, high, part.plane(volume), part.normal
    return Faces(*(tuple(map(np.float32, each)) for each in ends))


@inlined
def received(glow, ray, k):
    """Return the light that reaches sample k."""
    place, weights = light_place(glow, ray, k)
    return value_at(glow.grid, glow.shape, place, weights)


@inlined
def light_place(glow, ray, k):
    """Return the node of the light's grid before sample k, and the weights of the next ones."""
    (nx, ny, nz), (x, y, z) = glow.shape, times(place_on(ray, k), glow.scale)
    return locate(glow.shape, clamp(x, nx), clamp(y, ny), clamp(z, nz))


@inlined
def corner_of(glow, place, weights, corner):
    """Return one of the eight nodes around a place, and its weight there."""
    right, above, behind = corner & 1, (corner >> 1) & 1, corner >> 2
    share = weights[0] if right else ONE - weights[0]
    share *= weights[1] if above else ONE - weights[1]
    share *= weights[2] if behind else ONE - weights[2]
    at = place + np.uint64(right) + np.uint64(above) * np.uint64(glow.shape[0])
    return at + np.uint64(behind) * np.uint64(glow.shape[0] * glow.shape[1]), share


@inlined
def reflect(medium, light, ray, k):
    """Diffuse factor and white gloss of sample k; both sides of a surface are lit.

    The normal is the gradient's direction; where the gradient is noise, the sample is lit evenly.
    Within half a voxel of a face of the shown part, the face's normal is used, with a weight that
    falls to 0 at one voxel.
    """
    x, y, z = place_on(ray, k)
    normal = gradient(medium, x, y, z)
    change = dot(normal, normal)
    change *= change
    diffuse, gloss = HALF * light.diffuse, ZERO
    if change > ZERO:
        diffuse, gloss = mirror(light, ray, times(normal, light.slope))
        if light.noise > ZERO:
            share = change / (change + light.noise)
            even = HALF * light.diffuse
            diffuse = even + share * (diffuse - even)
            gloss *= share
    bx, by, bz, bn = depths_below(light.faces, x, y, z)
    if min(min(bx, bn), min(by, bz)) < ONE:
        return _by_faces(light, ray, (bx, by, bz, bn), diffuse, gloss)
    return diffuse, gloss


@called
def _by_faces(light, ray, depths, diffuse, gloss):
    """Diffuse factor and gloss of a sample next to faces of what is shown."""
    bx, by, bz, bn = depths
    bx, by, bz, bn = nearness(bx), nearness(by), nearness(bz), nearness(bn)
    lx, ly, lz = light.travel
    v = times(ray.step, light.spacing)
    total, share = bx + by + bz + bn, max(max(bx, bn), max(by, bz))
    across = dot(light.faces.normal, light.travel)
    flat = (bx * abs(lx) + by * abs(ly) + bz * abs(lz) + bn * abs(across)) * light.diffuse
    # The light mirrored by a face has its component along the axis, and minus the others.
    passing, length = dot(light.travel, v), dot(v, v)
    shine = bx * highlight(TWO * lx * v[0] - passing, length, light.power)
    shine += by * highlight(TWO * ly * v[1] - passing, length, light.power)
    shine += bz * highlight(TWO * lz * v[2] - passing, length, light.power)
    along = TWO * across * dot(light.faces.normal, v) - passing
    shine += bn * highlight(along, length, light.power)
    diffuse += share * (flat / total - diffuse)
    gloss += share * (light.specular * shine / total - gloss)
    return diffuse, gloss


@inlined
def depth_below(plane, x, y, z):
    """Return how many voxels a place is behind a clipping plane, on the side that is shown."""
    return plane[3] - (plane[0] * x + plane[1] * y + plane[2] * z)


@inlined
def depths_below(faces, x, y, z):
    """Return how many voxels a place is behind faces across x, y and z, and behind the plane."""
    low, high = faces.low, faces.high
    bx, by, bz = (
        min(x - low[0], high[0] - x),
        min(y - low[1], high[1] - y),
        min(z - low[2], high[2] - z),
    )
    return bx, by, bz, depth_below(faces.plane, x, y, z)


@inlined
def nearness(depth):
    """Return how much a face counts so many voxels behind it: 1 up to a half, 0 from one on."""
    return min(max(TWO - TWO * depth, ZERO), ONE)


@inlined
def highlight(along, square, power):
    """Return a power of the cosine of two directions, from their product and squared lengths."""
    return half_power(along * along / square, power) if along > ZERO else ZERO


@inlined
def mirror(light, ray, normal):
    """Diffuse factor and white gloss of a surface with a normal, of any length above 0."""
    inverse = ONE / math.sqrt(dot(normal, normal))
    across = dot(normal, light.travel) * inverse
    # Mirrored about the normal, as VTK does it: on the far side with the sign left out.
    twice = TWO * abs(across) * inverse
    (nx, ny, nz), (lx, ly, lz) = normal, light.travel
    m = twice * nx - lx, twice * ny - ly, twice * nz - lz
    v = times(ray.step, light.spacing)
    along = dot(m, v)
    if not along > ZERO:
        return light.diffuse * abs(across), ZERO
    # On the far side the mirrored direction is longer than 1.
    along *= along / (dot(m, m) * dot(v, v))
    return light.diffuse * abs(across), light.specular * half_power(along, light.power)


@inlined
def half_power(square, power):
    """Return a number to an even power, from its square, by few multiplications."""
    result, rest = ONE, power >> 1
    while rest > 0:
        if rest & 1:
            result *= square
        square *= square
        rest >>= 1
    return result


@inlined
def gradient(medium, x, y, z):
    """Interpolate the differences between the next and the previous voxel along each axis.

    This equals the difference of the field interpolated one voxel ahead and one behind, with
    positions clamped to the faces, but reads rows of voxels once. Next to the faces, for labels,
    whose differences mean nothing, and for large voxels, :func:`_by_64` is used.
    """
    voxels, shape = medium.voxels, medium.shape
    inner = x >= ONE and y >= ONE and z >= ONE
    inner = inner and x < np.float32(shape[0] - 2) and y < np.float32(shape[1] - 2)
    if medium.is_nearest:
        return _by_64(voxels, shape, None, x, y, z)
    if not (inner and z < np.float32(shape[2] - 2) and medium.blur == ZERO):
        return _by_64(voxels, shape, medium.blur, x, y, z)
    place, (fx, fy, fz) = locate(shape, x, y, z)
    row, layer = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
    # In the nearest row, the next row, the next layer, and the next row of that one.
    slope0, value0 = _along_x(voxels, place, fx)
    slope1, value1 = _along_x(voxels, place + row, fx)
    slope2, value2 = _along_x(voxels, place + layer, fx)
    slope3, value3 = _along_x(voxels, place + layer + row, fx)
    near = slope0 + fy * (slope1 - slope0)
    gx = near + fz * (slope2 + fy * (slope3 - slope2) - near)
    before, behind = _pair(voxels, place - row, fx), _pair(voxels, place + row + row, fx)
    near = _change(before, value0, value1, behind, fy)
    before = _pair(voxels, place + layer - row, fx)
    behind = _pair(voxels, place + layer + row + row, fx)
    far = _change(before, value2, value3, behind, fy)
    gy = near + fz * (far - near)
    before, behind = _pair(voxels, place - layer, fx), _pair(voxels, place + layer + layer, fx)
    near = _change(before, value0, value2, behind, fz)
    before = _pair(voxels, place + row - layer, fx)
    behind = _pair(voxels, place + row + layer + layer, fx)
    far = _change(before, value1, value3, behind, fz)
    gz = near + fy * (far - near)
    return gx, gy, gz


@inlined
def _along_x(voxels, place, fx):
    """Interpolated difference along x within a row, and the row's interpolated value."""
    before = np.float32(voxels[place - np.uint64(1)])
    first = np.float32(voxels[place])
    second = np.float32(voxels[place + np.uint64(1)])
    behind = np.float32(voxels[place + np.uint64(2)])
    return _change(before, first, second, behind, fx), first + fx * (second - first)


@inlined
def _pair(voxels, place, fx):
    first = np.float32(voxels[place])
    return first + fx * (np.float32(voxels[place + np.uint64(1)]) - first)


@inlined
def _change(before, first, second, behind, share):
    """Interpolate between the central differences at the inner two of four values."""
    change = second - before
    return change + share * (behind - first - change)


@called
def _by_64(voxels, shape, blur, x, y, z):
    """Gradient from the 64 voxels around: of the values, or of the share of the nearest label.

    Labels (blur None) are weighted by a cubic B-spline, so that staircases of voxels get smooth
    normals. Values are blurred perpendicular to each difference, as by Prewitt's operator, or large
    voxels would show as rings. Gradients do not depend on the TF, as its derivatives require.
    """
    x, y, z = clamp(x, shape[0]), clamp(y, shape[1]), clamp(z, shape[2])
    place, weights = locate(shape, x, y, z)
    own = voxels[nearest_of(shape, place, weights)]
    i, j, k = np.int32(x), np.int32(y), np.int32(z)
    gx, gy, gz = ZERO, ZERO, ZERO
    for n in range(16):
        b, c = j - 1 + (n & 3), k - 1 + (n >> 2)
        wy, dy = _weights(blur, y - np.float32(b))
        wz, dz = _weights(blur, z - np.float32(c))
        row = shape[0] * (min(max(b, 0), shape[1] - 1) + shape[1] * min(max(c, 0), shape[2] - 1))
        total, change = ZERO, ZERO
        for a in range(i - 1, i + 3):
            voxel = voxels[np.uint64(row + min(max(a, 0), shape[0] - 1))]
            value = np.float32(voxel == own) if blur is None else np.float32(voxel)
            wx, dx = _weights(blur, x - np.float32(a))
            total += wx * value
            change += dx * value
        gx += change * wy * wz
        gy += total * dy * wz
        gz += total * wy * dz
    return gx, gy, gz


@inlined
def _weights(blur, u):
    """Weights of a voxel at a distance of up to 2: in a value, and in its difference."""
    if blur is None:
        return spline(u)
    # Linear interpolation of blurred values, and of central differences.
    t = abs(u)
    near, beyond = max(ONE - t, ZERO), min(t, TWO - t)
    return near + blur * (beyond - TWO * near), -beyond if u > ZERO else beyond
