"""A volume with fewer voxels, for quick estimates of what an opacity TF shows of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.crop import CropBox
from model.scene.orientation import corners
from model.scene.tf_emphasis import raised
from model.scene.transfer_function import OpacityTF, Range
from model.scene.volume import Volume

GRID = 64  # largest number of voxels per axis
STRAY = 0.0005  # share of the opacity beyond each plane of a shown box: specks
LEAST_OPACITY = 0.005  # share of the largest opacity from which a voxel counts as shown
LEAST_RAY = 0.1  # opacity from which a ray counts as showing its voxels
SHOWS = 0.8  # opacity of the median ray after raising a TF
MOST_RAISE = 12  # most doublings of an opacity
LEVELS = 2048  # distinguished scalar values, eight per bin of a TF
_OPAQUE = 1 - 1e-6


@dataclass(frozen=True, eq=False)
class ThinnedVolume:
    """Every n-th voxel of a volume along each axis."""

    levels: NDArray[np.uint16]
    """Scalar values in :data:`LEVELS` even steps over the scalar range, so that a TF is evaluated
    once per step; hidden voxels have :data:`LEVELS` itself, which is transparent. Shape (nz, ny,
    nx)."""
    scalar_range: Range
    steps: tuple[float, ...]  # between voxels along z, y and x, in the volume's voxel sizes

    @classmethod
    def of(cls, volume: Volume) -> ThinnedVolume:
        """Take at most :data:`GRID` voxels per axis."""
        strides = [-(-length // GRID) for length in volume.voxels.shape]
        lo, hi = volume.scalar_range
        taken = tuple(slice(s // 2, None, s) for s in strides)
        some = volume.shown[taken]
        spacing = np.array(volume.spacing[::-1]) / volume.voxel_size
        places = np.clip((some.astype(np.float64) - lo) / (hi - lo), 0.0, 1.0)
        levels = np.rint(places * (LEVELS - 1)).astype(np.uint16)
        if volume.hidden is not None:
            levels[volume.hidden[taken]] = LEVELS
        return cls(levels, (lo, hi), tuple(strides * spacing))

    def ray_opacities(self, opacity: OpacityTF) -> NDArray[np.float64]:
        """Return the opacity of every ray along x, y or z through a voxel."""
        return np.concatenate([rays.ravel() for rays in self._rays(opacity)])

    def made_visible(self, opacity: OpacityTF) -> OpacityTF:
        """Raise the opacities by one factor until the median of the rays that they meet is .8."""
        rays = self.ray_opacities(opacity)
        met = rays > 0.05 * max(float(rays.max()), 1e-9)
        low, high = 0.0, float(MOST_RAISE)
        if not met.any() or np.median(rays[met]) >= SHOWS:
            return opacity
        for _ in range(MOST_RAISE):
            middle = (low + high) / 2
            ends = self.ray_opacities(raised(opacity, 2.0**middle))[met]
            low, high = (low, middle) if np.median(ends) >= SHOWS else (middle, high)
        return raised(opacity, 2.0**high)

    def shown_box(self, opacity: OpacityTF) -> CropBox:
        """Return a box around a TF's visible voxels, without stray ones; all if none is."""
        voxels = self._of_levels(opacity)[self.levels]
        if not voxels.sum() > 0:
            return CropBox()
        low, high = [], []
        for axis in (2, 1, 0):
            profile = voxels.sum(axis=tuple(a for a in range(3) if a != axis))
            shares = np.cumsum(profile) / profile.sum()
            # One voxel more on each side, as the surface may be between two.
            first = int(np.searchsorted(shares, STRAY)) - 1
            last = int(np.searchsorted(shares, 1 - STRAY)) + 2
            low.append(max(first, 0) / len(profile))
            high.append(min(last, len(profile)) / len(profile))
        return CropBox((low[0], low[1], low[2]), (high[0], high[1], high[2]))

    def shown_points(self, opacity: OpacityTF) -> NDArray[np.float64]:
        """Return points (n, 3) around an opacity TF's visible voxels: the ends of rows along x.

        They are fractions of the volume's lengths along x, y and z, within :meth:`shown_box`; the
        volume's corners if the TF shows nothing. A voxel is visible if it, and rays along at least
        two axes through it, are not transparent.
        """
        box = self.shown_box(opacity)
        voxels = self._of_levels(opacity)[self.levels]
        seen = voxels > LEAST_OPACITY * voxels.max()
        opaque = [rays >= LEAST_RAY * voxels.max() for rays in self._rays(opacity)]
        along_z, along_y, along_x = (np.expand_dims(rays, axis) for axis, rays in enumerate(opaque))
        seen &= along_z & along_y | along_y & along_x | along_x & along_z
        first = np.where(seen.any(axis=2), seen.argmax(axis=2), np.inf)
        last = np.where(seen.any(axis=2), seen.shape[2] - seen[:, :, ::-1].argmax(axis=2), -np.inf)
        ends = _at_edges(first), -_at_edges(-last)
        edges = np.argwhere(np.isfinite(ends[0]))
        points = (
            np.concatenate([np.column_stack([x[tuple(edges.T)], edges[:, ::-1]]) for x in ends])
            / seen.shape[::-1]
        )
        inside = ((points >= box.low) & (points <= box.high)).all(axis=1)
        return points[inside] if inside.any() else corners(box)

    def _rays(self, opacity: OpacityTF) -> list[NDArray[np.float64]]:
        """Opacities of the rays along z, y and x."""
        depths = -np.log1p(-np.minimum(self._of_levels(opacity), _OPAQUE))[self.levels]
        return [-np.expm1(-step * depths.sum(axis)) for axis, step in enumerate(self.steps)]

    def _of_levels(self, opacity: OpacityTF) -> NDArray[np.float64]:
        return np.append(opacity(np.linspace(*self.scalar_range, LEVELS)), 0.0)


def _at_edges(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Minimum over the up to four rows (z, y) that share an edge along x."""
    padded = np.pad(rows, 1, constant_values=np.inf)
    along_z = np.minimum(padded[:-1], padded[1:])
    return np.minimum(along_z[:, :-1], along_z[:, 1:])
