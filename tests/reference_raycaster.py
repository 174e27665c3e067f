"""A second ray caster, slow and in float64: what the real one is held against.

Written from the emission-absorption model alone. It knows the agreements that
every renderer here keeps: the camera's basis and view angle, a near plane in
front of which nothing is drawn, a sample at the end of each step from the point where
the ray enters the grid, the last step being shorter, and opacities that are corrected
for the step at 256 scalar values and linear between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from model.scene.view import VIEW_ANGLE, View
from model.scene.volume import Volume

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rays:
    """The samples of all rays of an image, in bins of the TF.

    Attributes
    ----------
    bins : ndarray, shape (size, size, samples)
        0 to 255; NaN behind a ray's end.
    shares : ndarray, shape (size, size, samples)
        Length of the step in front of each sample, as a fraction of a whole one.
    along : ndarray, shape (size, size, samples)
        World distance from the eye to each sample.
    """

    bins: Array
    shares: Array
    along: Array


def cast(volume: Volume, view: View, size: int, sample_distance: float) -> Rays:
    """Follow the rays through the centres of an image's pixels."""
    right, up, back = view.basis()
    distance = view.camera_distance(volume.radius)
    eye = np.array(volume.center) + distance * back - np.array(volume.origin)
    across = (2 * np.arange(size) + 1) / size - 1
    x, y = np.meshgrid(across, -across)
    tangent = math.tan(math.radians(VIEW_ANGLE / 2))
    towards = -back + tangent * (x[..., None] * right + y[..., None] * up)
    length = np.linalg.norm(towards, axis=-1)
    towards /= length[..., None]
    near = length * max(distance - 1.01 * volume.radius, 0.01 * volume.radius)
    extent = np.array(volume.extent)
    with np.errstate(divide="ignore", invalid="ignore"):
        faces = np.stack([-eye / towards, (extent - eye) / towards])
    enter = np.fmax(near, np.fmin(*faces).max(axis=-1))
    leave = np.fmax(*faces).min(axis=-1)
    step = sample_distance * volume.voxel_size
    steps = (np.maximum(leave - enter, 0) / step)[..., None]
    k = np.arange(max(int(np.ceil(steps.max())), 1))
    shares = np.clip(steps - k, 0, 1)
    along = enter[..., None] + (k + shares) * step
    positions = eye + along[..., None] * towards[..., None, :]
    voxels = positions / np.array(volume.spacing)
    lo, hi = volume.scalar_range
    scaled = (volume.voxels.astype(np.float64) - lo) / (hi - lo)
    values = map_coordinates(
        scaled, np.moveaxis(voxels[..., ::-1], -1, 0), order=1, mode="nearest", prefilter=False
    )
    bins = np.where(shares > 0, np.clip(255 * values, 0, 255), np.nan)
    return Rays(bins, shares, along)


def correct(opacity: Array, sample_distance: float) -> Array:
    """Opacity of a sample, from that of a voxel's length."""
    return 1 - (1 - opacity) ** sample_distance


def alphas_of(bins: Array, shares: Array, per_sample: Array) -> Array:
    """Opacity of each sample, 0 behind a ray's end; see :func:`composite`."""
    alpha = np.interp(np.nan_to_num(bins), np.arange(256), per_sample)
    return np.where(np.isfinite(bins), 1 - np.maximum(1 - alpha, 0) ** shares, 0)


def composite(bins: Array, shares: Array, per_sample: Array, color: Array) -> Array:
    """Composite samples front to back.

    Parameters
    ----------
    bins, shares : ndarray, shape (..., samples)
        See :class:`Rays`.
    per_sample : ndarray, shape (256,)
        Opacity of a whole step at each bin.
    color : ndarray, shape (256, 3)

    Returns
    -------
    ndarray, shape (..., 4)
        RGBA, premultiplied.
    """
    at, every = np.nan_to_num(bins), np.arange(256)
    alpha = alphas_of(bins, shares, per_sample)
    through = np.cumprod(1 - alpha, axis=-1)
    weight = alpha * np.concatenate([np.ones_like(through[..., :1]), through[..., :-1]], axis=-1)
    channels = [(weight * np.interp(at, every, c)).sum(axis=-1) for c in color.T]
    return np.stack([*channels, weight.sum(axis=-1)], axis=-1)


def depth(rays: Rays, per_sample: Array) -> Array:
    """World distance at which the accumulated opacity reaches 1/255; infinite where never."""
    alpha = alphas_of(rays.bins, rays.shares, per_sample)
    visible = 1 - np.cumprod(1 - alpha, axis=-1) >= 1 / 255
    return np.where(visible, rays.along, np.inf).min(axis=-1)


def render(
    volume: Volume, view: View, opacity: Array, color: Array, size: int, sample_distance: float
) -> Array:
    """Render an image, RGBA (size, size, 4), from TFs of 256 values."""
    rays = cast(volume, view, size, sample_distance)
    per_sample = correct(opacity.astype(np.float64), sample_distance)
    return composite(rays.bins, rays.shares, per_sample, color)
