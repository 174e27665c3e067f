"""Overview of what thousands of opacity TFs show in one view, without rendering them one by one.

Without light, a ray's opacity does not depend on the order of its samples: it follows from how
long the ray stays at each scalar value. These lengths are found once for a view; the opacity
images of all TFs are then a matrix product.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.rendering.raycast.camera import camera_array
from model.rendering.scalars import shown_voxels
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.view import View
from model.scene.volume import Volume

OVERVIEW_SIZE = 24
"""Width and height of the opacity images, in pixels."""

OPAQUE = 1 - 1e-4
"""Largest opacity of a voxel's length, so that its logarithm is finite."""

NOTHING = 0.01
"""Opacity below which a pixel shows nothing."""

SOLID_OPACITY, SOLID_SHARE = 0.9, 0.97
"""A solid block: the share of the volume's pixels that are at least as opaque."""

SHOWN_SHARE = 0.1
"""Share of what is seen that a band of scalar values needs to count as shown."""

PEAK_WIDTH = 4.0
"""Standard deviation in bins by which shares are smoothed to find the largest."""

_PART = 2000
"""TFs that are looked at together, to bound memory."""


@dataclass(frozen=True, eq=False)
class Overview:
    """What each of n TFs shows in one view.

    Attributes
    ----------
    opacity : ndarray of float32, shape (n,)
        Mean opacity of the image, in [0, 1].
    is_empty, is_solid : ndarray of bool, shape (n,)
        Whether no pixel shows anything; whether nearly all of the volume's are opaque.
    shares : ndarray of float32, shape (n, 256)
        Share of each scalar value's bin in what is seen, 0 for empty images. Which values
        hide which is not considered.
    dominant : ndarray of int64, shape (n,)
        Bin that most is seen of, with its neighbours.
    """

    opacity: NDArray[np.float32]
    is_empty: NDArray[np.bool_]
    is_solid: NDArray[np.bool_]
    shares: NDArray[np.float32]
    dominant: NDArray[np.int64]

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


@dataclass(frozen=True, eq=False)
class RayLengths:
    """How long the rays of a view stay at each scalar value.

    Attributes
    ----------
    lengths : ndarray of float32, shape (pixels, 256)
        In voxel lengths, by bins of the scalar range; row by row from the top.
    hits : ndarray of bool, shape (pixels,)
        Whether a ray meets the volume.
    """

    lengths: NDArray[np.float32]
    hits: NDArray[np.bool_]

    @classmethod
    def of(
        cls, volume: Volume, view: View, size: int = OVERVIEW_SIZE, distance: float = 0.5
    ) -> RayLengths:
        """Follow the rays of an image of this size, with about this distance between samples."""
        from scipy.ndimage import map_coordinates

        eye, directions, near, far = _rays(volume, view, size)
        step = distance * volume.voxel_size
        count = np.ceil(np.maximum(far - near, 0) / step).astype(np.int64)
        ray = np.repeat(np.arange(len(count)), count)
        first = np.repeat(np.cumsum(count) - count, count)
        length = np.divide(far - near, count, out=np.zeros(len(count)), where=count > 0)
        along = near[ray] + (np.arange(len(ray)) - first + 0.5) * length[ray]
        places = eye + along[:, None] * directions[ray]
        voxels = map_coordinates(
            shown_voxels(volume),
            places.T[::-1],
            np.float32,
            order=1,
            mode="nearest",
            prefilter=False,
        )
        lo, hi = volume.scalar_range
        bins = np.clip((voxels - lo) / (hi - lo), 0, 1) * (TF_SAMPLES - 1)
        below = np.minimum(bins.astype(np.int64), TF_SAMPLES - 2)
        share = bins - below
        weights = length[ray] / volume.voxel_size
        if volume.hidden is not None:
            nearest = np.rint(places[:, ::-1]).astype(np.int64)
            last = np.array(volume.hidden.shape) - 1
            weights[volume.hidden[tuple(np.clip(nearest, 0, last).T)]] = 0
        shape = (len(count), TF_SAMPLES)
        flat = ray * TF_SAMPLES + below
        lengths = np.bincount(flat, weights * (1 - share), np.prod(shape))
        lengths += np.bincount(flat + 1, weights * share, np.prod(shape))
        return cls(lengths.reshape(shape).astype(np.float32), count > 0)

    def overview(self, opacities: NDArray[np.floating]) -> Overview:
        """Return what TFs (n, 256) over the scalar range show."""
        parts = [
            self._overview(opacities[first : first + _PART])
            for first in range(0, len(opacities), _PART)
        ]
        return Overview(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))

    def _overview(self, opacities: NDArray[np.floating]) -> tuple[NDArray[Any], ...]:
        from scipy.ndimage import gaussian_filter1d

        extinction = _extinction(opacities)
        thickness = extinction @ self.lengths.T
        opacity = -np.expm1(-thickness)
        # A value's share of a pixel's opacity is its share of the pixel's optical thickness.
        ratio = np.divide(opacity, thickness, out=np.ones_like(opacity), where=thickness > 1e-6)
        shares = extinction * (ratio @ self.lengths)
        total = shares.sum(axis=1, keepdims=True)
        inside = opacity[:, self.hits]
        is_empty = ~(opacity > NOTHING).any(axis=1)
        is_solid = (inside > SOLID_OPACITY).mean(axis=1) > SOLID_SHARE if inside.size else ~is_empty
        seen = np.where(is_empty[:, None], 0, shares / np.maximum(total, 1e-30))
        seen = seen.astype(np.float32)
        smooth = gaussian_filter1d(seen, PEAK_WIDTH, axis=1, mode="constant")
        return opacity.mean(axis=1), is_empty, is_solid, seen, smooth.argmax(axis=1)


def _extinction(opacities: NDArray[np.floating]) -> NDArray[np.float32]:
    """Optical thickness of a voxel's length at each opacity."""
    return -np.log1p(-np.minimum(opacities, OPAQUE)).astype(np.float32)


def _rays(volume: Volume, view: View, size: int) -> tuple[NDArray[np.float64], ...]:
    """Eye (3,), directions (pixels, 3) in voxels, and the ends (pixels,) of rays in the volume.

    Ends are world distances from the eye; a ray that misses the volume ends before it begins.
    """
    camera = camera_array(view, volume)
    across = (2 * np.arange(size) + 1) / size - 1
    y, x = np.meshgrid(-across, across, indexing="ij")
    x, y = camera[14] + camera[15] * x.reshape(-1, 1), camera[16] + camera[17] * y.reshape(-1, 1)
    stretch = np.sqrt(1 + (x * x + y * y) * camera[13])
    directions = (camera[3:6] + x * camera[6:9] + y * camera[9:12]) / stretch
    last = np.array(volume.dimensions) - 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = -camera[:3] / directions, (last - camera[:3]) / directions
    inside = (camera[:3] >= 0) & (camera[:3] <= last)
    parallel = directions == 0
    enter = np.where(parallel, np.where(inside, -np.inf, np.inf), np.minimum(a, b))
    leave = np.where(parallel, np.inf, np.maximum(a, b))
    near = np.maximum(enter.max(axis=1), camera[12] * stretch[:, 0])
    return camera[:3], directions, near, np.maximum(leave.min(axis=1), near)
