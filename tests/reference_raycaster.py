"""A second ray caster, slow and in 64-bit arithmetic: what the real one is held against.

Written from the emission-absorption model alone. It knows the agreements that
every renderer here keeps: the camera's basis and view angle, a near plane in
front of which nothing is drawn, a sample at the end of each step from the point where
the ray enters the grid, the last step being shorter, and opacities that are corrected
for the step at 256 scalar values and linear between them.

Opacities may be complex numbers: what is computed of them is analytic, so that an image of
opacities with a tiny imaginary part has its exact derivative there.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates, minimum_filter

from model.rendering.raster import Raster
from model.scene.crop import CropBox
from model.scene.transfer_function import TF_SAMPLES
from model.scene.view import VIEW_ANGLE

LARGEST_OPACITY = 1 - 1 / 510


@dataclass(frozen=True)
class Rays:
    """The samples of all rays of an image, (rows, columns, samples), in bins of the TF.

    Bins, 0 to 255, are NaN behind a ray's end and where nothing was measured; shares are lengths of
    steps as fractions of a whole one, `along` world distances from the eye, places in voxels, x
    first, and `towards` the rays' directions in the world. A mask leaves `kept` of the opacities.
    """

    bins: np.ndarray
    shares: np.ndarray
    along: np.ndarray
    places: np.ndarray
    towards: np.ndarray
    kept: np.ndarray | None = None


def cast(volume, view, size, sample_distance, crop=None, is_nearest=False, mask=None, clip=None):
    """Follow the rays through the centres of an image's pixels, in steps of some voxels."""
    right, up, back = view.basis()
    distance = view.camera_distance(volume.radius)
    # From the first voxel: the origin may be so far away that nothing is left of the volume.
    extent = np.array(volume.extent)
    x, y = _pixels(Raster.of(size), view)
    tangent = math.tan(math.radians(VIEW_ANGLE / 2))
    across = tangent * (x[..., None] * right + y[..., None] * up)
    if view.is_orthographic:
        # From a plane outside the volume, of which the pixels' places are those in perspective
        # where the centre is.
        eye = extent / 2 + 2 * volume.radius * back + distance * across
        towards, distance = -back + np.zeros_like(across), 2 * volume.radius
    else:
        eye, towards = extent / 2 + distance * back, -back + across
    length = np.linalg.norm(towards, axis=-1)
    towards /= length[..., None]
    near = length * max(distance - 1.01 * volume.radius, 0.01 * volume.radius)
    box = crop or CropBox()
    low, high = (np.array(corner) * extent for corner in (box.low, box.high))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        faces = np.stack([(low - eye) / towards, (high - eye) / towards])
    enter = np.fmax(near, np.fmin(*faces).max(axis=-1))
    leave = np.fmax(*faces).min(axis=-1)
    if clip is not None:
        normal = np.array(clip.normal)
        deep = clip.offset * volume.radius - (eye - extent / 2) @ normal
        with np.errstate(divide="ignore"):
            cut = deep / (towards @ normal)
        leave = np.where(towards @ normal > 0, np.minimum(leave, cut), leave)
        enter = np.where(towards @ normal < 0, np.maximum(enter, cut), enter)
    hits = leave > enter
    enter = np.where(hits, enter, 0.0)
    step = sample_distance * volume.voxel_size
    steps = (np.where(hits, leave - enter, 0.0) / step)[..., None]
    k = np.arange(max(int(np.ceil(steps.max())), 1))
    shares = np.clip(steps - k, 0, 1)
    along = enter[..., None] + (k + shares) * step
    from_eye = along[..., None] * towards[..., None, :]
    places = (np.expand_dims(eye, -2) + from_eye) / np.array(volume.spacing)
    shown = shares > 0
    if volume.hidden is not None:
        shown &= ~nearest(volume.hidden, places)
    kept = None
    if mask is not None:
        left = mask.astype(np.float64)
        if volume.hidden is not None:
            # What is missing is masked like any that is around it.
            known = np.where(volume.hidden, 1, mask)
            left = np.where(volume.hidden, minimum_filter(known, 3), mask).astype(np.float64)
        kept = (nearest if is_nearest else interpolated)(left, places)
    values = (nearest if is_nearest else interpolated)(unit_field(volume), places)
    bins = np.where(shown, np.clip(255 * values, 0, 255), np.nan)
    return Rays(bins, shares, along, places, towards, kept)


def unit_field(volume):
    """Voxels (nz, ny, nx) with the scalar range mapped to 0 and 1; others may lie beyond."""
    voxels, (lo, hi) = volume.shown, volume.scalar_range
    # Whole numbers of 64 bits need more digits than float64 has; the largest would overflow.
    exact = voxels.astype(np.longdouble) / 2 - np.longdouble(lo) / 2
    return np.asarray(exact / (np.longdouble(hi) / 2 - np.longdouble(lo) / 2), dtype=np.float64)


def interpolated(field, places):
    """Interpolate at places (..., 3) in voxels, x first; beyond the faces as at them."""
    at = np.moveaxis(places[..., ::-1], -1, 0)
    return map_coordinates(field, at, order=1, mode="nearest", prefilter=False)


def correct(opacity, sample_distance):
    """Opacity of a sample, from that of a voxel's length.

    The derivative of an opaque one diverges; it is that of an opacity of :data:`LARGEST_OPACITY`.
    """
    if np.iscomplexobj(opacity):
        least = 1 - LARGEST_OPACITY if sample_distance < 1 else 0
        clear = np.maximum(1 - opacity.real, least)
        slope = sample_distance * clear ** (sample_distance - 1)
        return correct(opacity.real, sample_distance) + 1j * opacity.imag * slope
    if opacity.max() > 1:
        # Beyond what an opacity is, for differences of whole steps.
        return 1 - (1 - opacity) ** sample_distance
    with np.errstate(divide="ignore"):
        return -np.expm1(sample_distance * np.log1p(-opacity))


def at_bins(bins, table):
    """Look up a table of 256 values, linear between them; at its start where there is no bin."""
    return np.interp(np.nan_to_num(bins), np.arange(TF_SAMPLES), table)


def kept_of(rays, opacity, sample_distance):
    """Opacity of whole steps of which a mask leaves a part, by the TF's for a voxel's length."""
    at = np.nan_to_num(rays.bins)
    lower = np.minimum(at.astype(int), TF_SAMPLES - 2)
    first, last = (correct(rays.kept * opacity[lower + n], sample_distance) for n in (0, 1))
    return first + (at - lower) * (last - first)


def alphas_of(bins, shares, per_sample, least=0.0):
    """Opacity of each sample, 0 behind a ray's end; `per_sample` is by bins (256,) or samples.

    Of a lower transparency than `least` derivatives are those at it: by a part of a step, they
    diverge.
    """
    alpha = at_bins(bins, per_sample) if per_sample.ndim == 1 else per_sample
    clear = np.maximum(1 - alpha.real, 0)
    # Powers of 1 - alpha would lose what is fainter than the last digit of 1.
    with np.errstate(divide="ignore", invalid="ignore"):
        of_part = np.where(shares > 0, -np.expm1(shares * np.log1p(-np.minimum(alpha.real, 1))), 0)
    if np.iscomplexobj(alpha):
        with np.errstate(divide="ignore"):
            slope = shares * np.maximum(clear, least) ** (shares - 1)
        of_part = of_part + 1j * alpha.imag * np.where(shares < 1, slope, 1.0)
    return np.where(np.isfinite(bins), of_part, 0)


def weights_of(alpha):
    """Opacity of each sample times the transparency of all before it, along the last axis."""
    through = np.cumprod(1 - alpha, axis=-1)
    return alpha * np.concatenate([np.ones_like(through[..., :1]), through[..., :-1]], axis=-1)


def depth(rays, per_sample):
    """World distance at which the accumulated opacity reaches 1/255; infinite where never."""
    alpha = alphas_of(rays.bins, rays.shares, per_sample)
    visible = 1 - np.cumprod(1 - alpha, axis=-1) >= 1 / 255
    return np.where(visible, rays.along, np.inf).min(axis=-1)


def _pixels(raster, view):
    """Places of the pixels' centres, to the right and up, in halves of the shorter side."""
    columns = 2 * (raster.left + np.arange(raster.columns)) + 1 - raster.width
    rows = raster.height - 2 * (raster.top + np.arange(raster.rows)) - 1
    shorter = min(raster.width, raster.height)
    x, y = np.meshgrid(columns / shorter - view.pan_x, rows / shorter - view.pan_y)
    return x, y


def nearest(field, places):
    """Value of the nearest voxel at places (..., 3)."""
    last = np.array(field.shape[::-1]) - 1
    x, y, z = np.moveaxis(np.clip(np.floor(places + 0.5), 0, last).astype(np.int64), -1, 0)
    return field[z, y, x]
