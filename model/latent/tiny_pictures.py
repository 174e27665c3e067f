"""Tiny pictures of what thousands of opacity TFs show in one view.

The samples along a view's rays do not depend on the TF. They are read from the volume once, and
all TFs are drawn over them, lit from the eye.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.compilation import compiled
from model.rendering.brightness import LIT_BRIGHTNESS, brighten
from model.rendering.ray_places import cut_rays
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.volume import Volume
from model.threads import in_threads

OVERVIEW_SIZE = 24  # width and height of the tiny pictures, in pixels

MOST_SAMPLES = 320
"""Samples along the volume's diagonal; in large volumes they are further apart than voxels."""

OPAQUE = 1 - 1e-4  # largest opacity of a voxel's length, so that its logarithm is finite
NOTHING = 0.01  # opacity, or brightness, below which a pixel shows nothing

SOLID_OPACITY, SOLID_SHARE = 0.9, 0.97
"""A solid block: the share of the volume's pixels that are at least as opaque."""

SHOWN_SHARE = 0.1  # share of what is seen that a band of scalar values needs to count as shown
PEAK_WIDTH = 4.0  # standard deviation in bins by which shares are smoothed to find the largest
AMBIENT = 0.1  # light that a surface reflects which is seen from its side

BRIGHT, BRIGHT_SHARE = 0.8, 0.01
"""An exposed picture: the brightness that this share of its content exceeds."""

LEAST_CONTENT = 0.1, 0.006
"""The brightness that a picture exceeds if it is shown, and in which share of its pixels."""

MOST_EXPOSED = 16.0
"""Largest factor of an exposure: what needs a larger one is too faint for a picture."""

_PART = 500  # TFs that a thread draws at a time


@dataclass(frozen=True, eq=False)
class Overview:
    """Tiny pictures of n TFs in one view."""

    opacity: NDArray[np.float32]  # mean of the image (n,), in [0, 1]
    is_empty: NDArray[np.bool_]  # (n,): whether no pixel shows anything
    is_faint: NDArray[np.bool_]  # (n,): whether even exposure does not make much of it bright
    is_solid: NDArray[np.bool_]  # (n,): whether nearly all of the volume's pixels are opaque
    shares: NDArray[np.float32]  # of each bin in what is seen (n, 256), 0 for empty images
    dominant: NDArray[np.int64]  # bin (n,) that most is seen of, with its neighbours
    pictures: NDArray[np.uint8]  # the tiny pictures (n, pixels, 3), exposed

    @property
    def shows_something(self) -> NDArray[np.bool_]:
        """Whether an image is neither empty nor a solid block, for each TF."""
        return ~(self.is_empty | self.is_solid)

    def dominant_values(self, scalar_range: Range) -> NDArray[np.float32]:
        """Scalar value (n,) that most is seen of, in the data's units; NaN for empty images."""
        values = np.linspace(*scalar_range, TF_SAMPLES, dtype=np.float32)
        return np.where(self.is_empty, np.float32(np.nan), values[self.dominant])

    def shows(self, band: Range, scalar_range: Range) -> NDArray[np.bool_]:
        """Whether each TF shows a band of scalar values, in the data's units."""
        values, bin_width = np.linspace(*scalar_range, TF_SAMPLES, retstep=True)
        # A single value lies between two bins.
        half = bin_width / 2
        inside = (values >= min(band) - half) & (values <= max(band) + half)
        return np.asarray(self.shares[:, inside].sum(axis=1) >= SHOWN_SHARE)


def overview_of(
    volume: Volume,
    inputs: SceneInputs,
    tfs: NDArray[np.floating],
    size: int = OVERVIEW_SIZE,
    distance: float | None = None,
    progress: Callable[[float], object] = lambda _done: None,
) -> Overview:
    """Return what opacity TFs (n, 256) show in the view, crop box and colours of some inputs.

    `progress` is called with shares of them, in several threads.
    """
    from scipy.ndimage import gaussian_filter1d

    if distance is None:
        diagonal = float(np.linalg.norm(volume.extent)) / volume.voxel_size
        distance = max(diagonal / MOST_SAMPLES, 1.0)
    first, bins, light = _samples(volume, inputs, size, distance)
    colors = np.ascontiguousarray(inputs.color_tf.sample(volume.scalar_range), np.float32)
    alphas = -np.expm1(distance * np.log1p(-np.minimum(tfs, OPAQUE))).astype(np.float32)
    pictures = np.empty((len(alphas), size**2, 3), np.uint8)
    shares, opacity = np.zeros_like(alphas), np.zeros((len(alphas), size**2), np.float32)
    factors = np.empty(len(alphas), np.float32)

    done = itertools.count(_PART, _PART)

    def draw(start: int) -> None:
        part = slice(start, start + _PART)
        drawn = np.zeros(pictures[part].shape, np.float32)
        _draw(first, bins, light, alphas[part], colors, drawn, opacity[part], shares[part])
        factors[part] = exposures(drawn, LIT_BRIGHTNESS)
        for picture, factor in zip(drawn, factors[part], strict=True):
            brighten(picture, float(factor))
        pictures[part] = np.rint(255 * drawn.clip(0, 1))
        progress(next(done) / len(alphas))

    in_threads(draw, range(0, len(alphas), _PART))
    inside = opacity[:, np.diff(first) > 0]
    is_empty = opacity.max(axis=1) <= NOTHING
    is_solid = (inside > SOLID_OPACITY).sum(axis=1) > SOLID_SHARE * inside.shape[1]
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1e-30)
    shares[is_empty] = 0
    smooth = gaussian_filter1d(shares, PEAK_WIDTH, axis=1, mode="constant")
    content = (pictures > 255 * LEAST_CONTENT[0]).any(axis=2).mean(axis=1)
    is_faint = (factors >= MOST_EXPOSED * LIT_BRIGHTNESS) | (content < LEAST_CONTENT[1])
    return Overview(
        opacity.mean(axis=1), is_empty, is_faint, is_solid, shares, smooth.argmax(axis=1), pictures
    )


def exposures(pictures: NDArray[np.floating], usual: float) -> NDArray[np.float32]:
    """Brightness (n,) at which faint pictures (n, pixels, 3) show as much as bright enough ones."""
    largest = np.maximum(np.maximum(pictures[..., 0], pictures[..., 1]), pictures[..., 2])
    content = (largest > NOTHING / usual).sum(axis=1)
    last = largest.shape[1] - 1
    number = last - np.ceil(BRIGHT_SHARE * content).astype(np.int64)
    bright = np.clip(np.sort(largest, axis=1)[np.arange(len(largest)), number], 1e-6, 1 - 1e-6)
    # The factor at which the display curve shows it as BRIGHT.
    wanted = BRIGHT * (1 - bright) / (bright * (1 - BRIGHT))
    found = np.clip(wanted, usual, MOST_EXPOSED * usual)
    return np.where(content > 0, found, usual).astype(np.float32)


@compiled
def _draw(first, bins, light, alphas, colors, pictures, opacity, shares):
    """Draw TFs by the opacities of a step; what is behind almost opaque samples is left out."""
    for tf in range(len(alphas)):
        for ray in range(len(first) - 1):
            through = np.float32(1)
            for sample in range(first[ray], first[ray + 1]):
                value = bins[sample]
                alpha = alphas[tf, value]
                if alpha > 0:
                    seen = through * alpha
                    shares[tf, value] += seen
                    lit = seen * light[sample]
                    for channel in range(3):
                        pictures[tf, ray, channel] += lit * colors[value, channel]
                    through -= seen
                    if through < np.float32(0.004):
                        break
            opacity[tf, ray] = 1 - through


def _samples(
    volume: Volume, inputs: SceneInputs, size: int, distance: float
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.float32]]:
    """Return the first sample of each ray and the number of all, and samples' bins and light."""
    from scipy.ndimage import map_coordinates

    middles = (2 * np.arange(size) + 1) / size - 1
    x, y = (each.ravel() for each in np.meshgrid(middles, -middles))
    eyes, directions, near, far = cut_rays(volume, inputs, np.stack([x, y], axis=1))
    step, last = distance * volume.voxel_size / volume.radius, np.array(volume.dimensions) - 1
    eyes, directions = eyes * last, directions * last
    count = np.ceil(np.maximum(far - near, 0) / step - 0.5).astype(np.int64)
    ray = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(ray)) - np.repeat(np.cumsum(count) - count, count)
    along = near[ray] + (number + 0.5) * step
    places = (eyes[ray] + along[:, None] * directions[ray])[:, ::-1]
    voxels = volume.shown

    def values(offset: NDArray[np.float64]) -> NDArray[np.float32]:
        at = (places + offset).T
        return map_coordinates(voxels, at, np.float32, order=1, mode="nearest", prefilter=False)

    lo, hi = volume.scalar_range
    bins = np.rint(np.clip((values(np.zeros(3)) - lo) / (hi - lo), 0, 1) * (TF_SAMPLES - 1))
    spacing = np.array(volume.spacing)[::-1]
    slopes = [(values(axis) - values(-axis)) for axis in np.eye(3)] / spacing[:, None]
    back = directions[ray][:, ::-1].T * spacing[:, None]
    steepness = np.linalg.norm(slopes, axis=0)
    facing = np.abs((slopes * back).sum(axis=0)) / np.linalg.norm(back, axis=0)
    # Where nothing is steep, there is no surface that could face the eye.
    flat = steepness < 1e-3 * (hi - lo) / volume.voxel_size
    facing = np.where(flat, 0.5, facing / np.maximum(steepness, 1e-30))
    light = (AMBIENT + (1 - AMBIENT) * facing).astype(np.float32)
    nearest = np.clip(np.rint(places).astype(np.int64), 0, last[::-1]).T
    there = np.ones(len(ray), bool) if volume.hidden is None else ~volume.hidden[tuple(nearest)]
    if inputs.mask is not None:
        there &= inputs.mask.shows(*nearest[::-1])
    ray, bins, light = ray[there], bins[there], light[there]
    return np.searchsorted(ray, np.arange(len(count) + 1)), bins.astype(np.uint8), light
