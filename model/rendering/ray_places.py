"""Places under a pixel: where along its ray a volume is visible."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from model.rendering.opacity_correction import per_sample
from model.scene.filling import means_around
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask, masked_voxels
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.view import Projection
from model.scene.volume import Triple, Volume

APART = 0.5  # distance of samples along a ray, in voxel sizes
VISIBLE = 1 / 255  # accumulated opacity at which a ray has met something visible
FAINTEST = 0.05  # least share of the ray's opacity that makes a separate place
FALL = 0.5  # share of a peak below which weights fall between two places


def cut_rays(
    volume: Volume, inputs: SceneInputs, at: NDArray[np.float64]
) -> tuple[NDArray[np.float64], ...]:
    """Return eyes and rays (n, 3) of pixels (n, 2), and their entry and exit (n,).

    A pixel is to the right and up from the image's middle, in halves of its shorter side. Eyes are
    in fractions of the volume's lengths; entry and exit of the shown part are in ray lengths of
    half its diagonal. A ray that misses exits no later than it enters.
    """
    shape, box = volume.proportions, inputs.part.crop
    projection = Projection(inputs.view, shape)
    eyes, ahead = (projection.points(at, np.full(len(at), along)) for along in (0.0, 1.0))
    cosines = projection.depths(ahead) - projection.depths(eyes)
    # Depth of each ray's ends behind the planes of the shown part.
    near, far = (np.hstack([points - box.low, box.high - points]) for points in (eyes, ahead))
    if (clip := inputs.clip) is not None:
        near, far = np.c_[near, clip.depths(eyes, shape)], np.c_[far, clip.depths(ahead, shape)]
    with np.errstate(divide="ignore", invalid="ignore"):
        cuts = near / (near - far)
    enter = np.where(far > near, cuts, -np.inf).max(axis=1)
    leave = np.where(far < near, cuts, np.inf).min(axis=1)
    misses = ((far == near) & (near < 0)).any(axis=1)
    enter = np.maximum(enter, inputs.view.near_distance(1.0) / cosines)
    return eyes, ahead - eyes, enter, np.where(misses, enter, leave)


def places_along(
    volume: Volume, inputs: SceneInputs, at: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points (n, 3) along a pixel's ray, in fractions, and their shares of its opacity."""
    (start,), (ray,), (enter,), (leave,) = cut_rays(volume, inputs, np.array([at]))
    step = APART * volume.voxel_size / volume.radius
    count = int(np.ceil((leave - enter) / step)) if leave > enter else 0
    along = np.minimum(enter + step * np.arange(1, count + 1), leave)
    points = start + along[:, None] * ray
    values = values_at(volume, points, inputs.is_nearest(volume), inputs.mask)
    lo, hi = volume.scalar_range
    bins = (TF_SAMPLES - 1) * np.clip((values - lo) / (hi - lo), 0, 1)
    opacities = inputs.opacity_tf.sample(volume.scalar_range)
    opacity = np.interp(bins, np.arange(TF_SAMPLES), opacities)
    if inputs.mask is not None:
        corners = _corners(volume, points, inputs.is_nearest(volume))
        opacity *= sum(share * inputs.mask.shows(*at.T) for at, share in corners)
    alphas = np.where(np.isfinite(bins), per_sample(opacity, APART), 0)
    # The last step is shorter.
    alphas = 1 - (1 - alphas) ** (np.diff(along, prepend=enter) / step)
    through = np.cumprod(1 - alphas)
    return points, alphas * np.concatenate([[1.0], through])[:count]


def most_visible(
    volume: Volume, inputs: SceneInputs, at: tuple[float, float], listed: Sequence[Range] = ()
) -> NDArray[np.float64] | None:
    """Return the point (3,) that adds most to a pixel; None if it shows nothing.

    It is sought among those with values of the first listed band that the pixel shows.
    """
    points, adds = places_along(volume, inputs, at)
    if adds.sum() < VISIBLE:
        return None
    lo, hi = volume.scalar_range
    values = values_at(volume, points, inputs.is_nearest(volume), inputs.mask)
    half = (hi - lo) / (TF_SAMPLES - 1) / 2
    for low, high in listed:
        own = np.where((values >= low - half) & (values <= high + half), adds, 0)
        if own.any():
            adds = own
            break
    return points[adds.argmax()].clip(0, 1)  # rounding may take them out of the volume


def ray_places(
    volume: Volume, inputs: SceneInputs, at: tuple[float, float]
) -> list[tuple[Triple, float]]:
    """Return the places under a pixel, from the eye on, with their shares of its opacity."""
    points, weights = places_along(volume, inputs, at)
    whole = float(weights.sum())
    if whole < VISIBLE:
        return []
    # Means of two samples, so that noise makes no places.
    starts = _valleys((weights + np.append(weights[1:], 0.0)).tolist())
    found: list[tuple[Triple, float]] = []
    for first, last in zip([0, *starts], [*starts, len(weights)], strict=True):
        part = weights[first:last]
        if part.sum() >= FAINTEST * whole:
            # Rounding may take them out of the volume.
            x, y, z = points[first + int(np.argmax(part))].clip(0, 1).tolist()
            found.append(((x, y, z), float(part.sum()) / whole))
    return found


def _valleys(weights: list[float]) -> list[int]:
    """Samples at which one place ends and the next begins."""
    found, lowest = list[int](), 0
    highest, is_falling = 0.0, False
    for number, weight in enumerate(weights):
        if not is_falling:
            highest = max(highest, weight)
            if weight < FALL * highest:
                is_falling, lowest = True, number
        elif weight < weights[lowest]:
            lowest = number
        elif FALL * weight > weights[lowest] and weight > FAINTEST * highest:
            found.append(lowest)
            highest, is_falling = weight, False
    return found


def values_at(
    volume: Volume,
    points: NDArray[np.float64],
    is_nearest: bool = False,
    mask: Mask | None = None,
) -> NDArray[np.float64]:
    """Return the values (n,) at points (n, 3) as renderers interpolate them; NaN outside."""
    hidden = volume.hidden
    ((nearest, _),) = _corners(volume, points, True)
    missing = np.zeros(len(points), bool) if hidden is None else hidden[tuple(nearest.T[::-1])]
    masked = None if mask is None else masked_voxels(volume, mask)
    total, weights = np.zeros(len(points)), np.zeros(len(points))
    for corner, weight in _corners(volume, points, is_nearest):
        at = tuple(corner.T[::-1])
        if hidden is not None:
            weight = np.where(hidden[at], 0.0, weight)
        values = volume.shown[at].astype(np.float64)
        if masked is not None and not volume.file.is_labels:
            # As renderers do.
            is_out, flat = masked[at], volume.shown.reshape(-1)
            places = np.ravel_multi_index(at, masked.shape)[is_out]
            with np.errstate(invalid="ignore"):
                means = means_around(flat, masked, places)
                values[is_out] = np.fmin(values[is_out], means)
        total += np.where(weight > 0, weight * values, 0.0)
        weights += weight
    known = ~missing & (weights > 0)
    return np.where(known, total / np.where(known, weights, 1.0), np.nan)


def _corners(
    volume: Volume, points: NDArray[np.float64], is_nearest: bool
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float64]]]:
    """Yield the voxels (n, 3), x first, around points (n, 3), and their weights."""
    last = np.array(volume.dimensions) - 1
    places = np.clip(points, 0.0, 1.0) * last
    if is_nearest:
        yield np.rint(places).astype(np.intp), np.ones(len(points))
        return
    before = np.minimum(places.astype(np.intp), np.maximum(last - 1, 0))
    share = places - before
    for corner in itertools.product((0, 1), repeat=3):
        weight = np.where(corner, share, 1 - share).prod(axis=1)
        yield np.minimum(before + corner, last), weight
