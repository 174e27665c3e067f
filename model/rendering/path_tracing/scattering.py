"""Scattering of light at a collision: by a surface or by a medium.

A place is a surface with a probability that grows with opacity and gradient, and a medium
otherwise. Surfaces reflect as Lambert's do, with a little gloss over that; media by the phase
function of Henyey and Greenstein (1941). Directions are in world coordinates, of length 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from model.compilation import inlined
from model.rendering.raycast.rays import ONE, ZERO, dot, times
from model.rendering.raycast.shading import depths_below, gradient, nearness

TURN = np.float32(2 * math.pi)
QUARTER, TWO = np.float32(0.25), np.float32(2)
ROUND = np.float32(1e-4)  # asymmetry below which a phase function counts as isotropic
DARKEST = 0.6  # brightest component below which colours scatter alike after the first collision


class Optics(NamedTuple):
    """Light of a scene, and how it scatters."""

    towards: Any  # tuple of 3 float32: unit vector to the middle of the light
    cone: Any  # float32: cosine of the light's angular radius
    key: Any  # float32: radiance of a white surface that faces the light
    sky: Any  # float32: radiance that comes from everywhere else
    asymmetry: Any  # float32: mean cosine of the phase function, -1 to 1
    gloss: Any  # float32: share of the light that surfaces mirror, whatever their colour is
    power: Any  # float32: exponent of the gloss
    steepness: Any
    """Tuple of 3 float32: factors of differences between voxels along each axis: a gradient of 1
    is a surface with a probability of 63 %, if opaque."""
    noise: Any  # float32: fourth power of the difference of voxels of which half counts as noise
    slope: Any  # tuple of 3 float32: factors from differences of voxels to the gradient's direction
    faces: Any  # float32: probability that an opaque face of what is shown is a surface
    bounces: Any  # int: most collisions of a path
    solid: Any  # float32, as `Medium.alphas`: probability that what is steep enough is a surface
    surfaces: Any
    media: Any  # float32 (4 levels,): shares of light that go on at a collision, see :func:`shares`


def single_scattering_albedo(
    color: NDArray[np.floating], asymmetry: float = 0.0
) -> NDArray[np.float64]:
    """Albedo of a medium of which a thick, evenly lit piece has a colour, seen face-on.

    Such a piece has the radiance 1 - s H(1), H being Chandrasekhar's function and s^2 = 1 - albedo
    for isotropic scattering. H(1) = 3 / (1 + 2 s) is within 4 % (Hapke 1981), and the
    similarity relation (van de Hulst 1980) accounts for the asymmetry.
    """
    color = np.asarray(color, dtype=np.float64)
    s = (1 - color) / (1 + 2 * color)
    return np.asarray((1 - s**2) / (1 - asymmetry * s**2))


def facet_albedo(color: NDArray[np.floating]) -> NDArray[np.float64]:
    """Albedo of facets such that many layers of them reflect a given colour.

    A surface is not sharp: light that leaves it meets further facets, which reflect some of it. For
    a reflectance r, a two-stream model gives the albedo 2 r / (1 + r^2); r (2 - r) is closer to the
    paths' result, within 0.04 for light from the viewer's direction.
    """
    color = np.asarray(color, dtype=np.float64)
    return np.asarray(color * (2 - color))


def shares(
    color: NDArray[np.floating], reflects: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> NDArray[np.float32]:
    """Shares (..., 4) of light scattered at a collision, such that many collisions give a colour.

    These are red, green and blue at the first collision, and one share at all later ones, which is
    that of the brightest component. The others are relative to it at the first collision only, so
    that the hue is the TF's however often light is scattered. Later collisions of dark colours
    (..., 3 or more) have the share of :data:`DARKEST`, as light that is scattered once would
    otherwise be too bright.
    """
    color = np.asarray(color, dtype=np.float64)[..., :3]
    brightest = np.maximum(color.max(axis=-1, keepdims=True), DARKEST)
    share = reflects(brightest)
    return np.concatenate([color * (share / brightest), share], axis=-1).astype(np.float32)


@inlined
def about(axis, cosine, turn):
    """Return the direction at an angle from an axis, turned about it by a share of a full turn."""
    nx, ny, nz = axis
    sine = math.sqrt(max(ZERO, ONE - cosine * cosine))
    # Two directions across the axis, without a case where they vanish (Duff et al. 2017).
    sign = ONE if nz >= ZERO else -ONE
    a = -ONE / (sign + nz)
    b = nx * ny * a
    c, s = sine * math.cos(TURN * turn), sine * math.sin(TURN * turn)
    return (
        cosine * nx + c * (ONE + sign * nx * nx * a) + s * b,
        cosine * ny + c * sign * b + s * (sign + ny * ny * a),
        cosine * nz - c * sign * nx - s * ny,
    )


@inlined
def phase(cosine, asymmetry):
    """Phase function times pi, of the angle between the directions before and after."""
    if abs(asymmetry) < ROUND:
        return QUARTER
    square = asymmetry * asymmetry
    base = ONE + square - TWO * asymmetry * cosine
    return QUARTER * (ONE - square) / (base * math.sqrt(base))


@inlined
def phase_cosine(number, asymmetry):
    """Draw the cosine of the angle between the directions before and after."""
    if abs(asymmetry) < ROUND:
        return ONE - TWO * number
    square = asymmetry * asymmetry
    part = (ONE - square) / (ONE - asymmetry + TWO * asymmetry * number)
    return min(max((ONE + square - part * part) / (TWO * asymmetry), -ONE), ONE)


@inlined
def surface_at(scatterer, optics, x, y, z, direction, a, number):
    """Decide whether a place is a surface, and return its normal towards where light came from.

    Within a voxel of a face of what is shown the face's normal counts.
    """
    bx, by, bz, bn = depths_below(scatterer.faces, x, y, z)
    bx, by, bz, bn = nearness(bx), nearness(by), nearness(bz), nearness(bn)
    face = max(bx, max(by, bz))
    is_cut = bn > face
    face = max(face, bn)
    share = face * optics.faces
    if number < a * share:
        nx, ny, nz = ZERO, ZERO, ZERO
        if is_cut:
            nx, ny, nz = scatterer.faces.normal
        elif bx == face:
            nx = ONE
        elif by == face:
            ny = ONE
        else:
            nz = ONE
    elif number < a:
        normal = gradient(scatterer.medium, x, y, z)
        square = dot(normal, normal)
        square *= square
        rise = times(normal, optics.steepness)
        steep = dot(rise, rise)
        share = (ONE - face) * (ONE - math.exp(-math.sqrt(steep)))
        share *= square / (square + optics.noise) if square > ZERO else ZERO
        if number >= a * (face * optics.faces + share):
            return False, direction
        normal = times(normal, optics.slope)
        inverse = ONE / math.sqrt(dot(normal, normal))
        nx, ny, nz = times(normal, (inverse, inverse, inverse))
    else:
        return False, direction
    if dot((nx, ny, nz), direction) > ZERO:
        return True, (-nx, -ny, -nz)
    return True, (nx, ny, nz)
