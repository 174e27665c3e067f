"""A coarse volume that knows its spread: a mean for each node, and how much the means miss."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from model.rendering.scalars import unit_planes
from model.scene.volume import Triple, Volume, extent_of

MEAN_STEPS = 255
"""Steps of the mean over the scalar range: those between the 256 bins of a TF."""

SPREAD_STEPS = 510
"""Steps of the spread over the scalar range, of which no spread exceeds half."""

SPREADS = 16
"""Levels of the spread: level j is a spread of j^2 steps, as small ones need finer levels.

Half a byte. More nodes are worth more than finer levels: with 1.45 million nodes and half a
byte instead of 1.1 million and a byte, images are nearer to the truth by a tenth.
"""

NODE_BYTES = 1.5
"""Bytes of a node with its spread; without, it is one."""


@dataclass(frozen=True, eq=False)
class CoarseVolume:
    """Means and spreads of a volume's voxels, on a coarser grid over the same box.

    Attributes
    ----------
    means : ndarray of uint8, shape (nz, ny, nx)
        In steps of 1/255 of the scalar range from its lowest value.
    spreads : ndarray of uint8, shape (nz, ny, nx)
        Level of the spread, which is the root mean square of what interpolation of the
        means misses of the voxels around a node.
    spacing : tuple of float
        Distance between nodes along x, y and z, in diameters of the bounding sphere.
    voxel_size : float
        Geometric mean of the volume's own spacing, in the same unit.
    """

    means: NDArray[np.uint8]
    spreads: NDArray[np.uint8]
    spacing: Triple
    voxel_size: float

    @classmethod
    def of(cls, volume: Volume, most: int) -> CoarseVolume:
        """Average a volume onto a grid of at most about `most` nodes."""
        shape = coarse_shape(volume.dimensions, most)
        averages = [_averaging(n, m) for n, m in zip(volume.dimensions, shape, strict=True)]
        enlargements = [_enlarging(n, m) for n, m in zip(volume.dimensions, shape, strict=True)]

        def missed(means: NDArray[np.float32]) -> Iterator[NDArray[np.float32]]:
            for plane, enlarged in zip(
                _planes(volume), _enlarged(means, enlargements), strict=True
            ):
                yield plane - enlarged

        means = _averaged(_planes(volume), averages)
        # Interpolation blurs the means once more. To add what they miss sharpens them: images
        # are a fifth to a third nearer to the truth, and a second time gains nothing.
        means += _averaged(missed(means), averages)
        spreads = np.sqrt(_averaged((miss**2 for miss in missed(means)), averages))
        levels = np.rint(np.sqrt(spreads * SPREAD_STEPS)).clip(0, SPREADS - 1)
        return cls.over(
            volume.dimensions,
            volume.proportions,
            np.rint(means.clip(0, 1) * MEAN_STEPS).astype(np.uint8),
            levels.astype(np.uint8),
        )

    @classmethod
    def plain(cls, volume: Volume, most: int) -> CoarseVolume:
        """Average a volume as anyone would: by means alone, neither sharpened nor with spread."""
        shape = coarse_shape(volume.dimensions, most)
        averages = [_averaging(n, m) for n, m in zip(volume.dimensions, shape, strict=True)]
        means = np.rint(_averaged(_planes(volume), averages).clip(0, 1) * MEAN_STEPS)
        means = means.astype(np.uint8)
        return cls.over(volume.dimensions, volume.proportions, means, np.zeros_like(means))

    @classmethod
    def over(
        cls,
        dimensions: tuple[int, int, int],
        proportions: Triple,
        means: NDArray[np.uint8],
        spreads: NDArray[np.uint8],
    ) -> CoarseVolume:
        """Put nodes over a volume of these dimensions and proportions."""
        nz, ny, nx = means.shape
        sx, sy, sz = (p / (n - 1) for p, n in zip(proportions, (nx, ny, nz), strict=True))
        fine = (p / (n - 1) for p, n in zip(proportions, dimensions, strict=True))
        return cls(means, spreads, (sx, sy, sz), math.prod(fine) ** (1 / 3))

    @property
    def is_whole(self) -> bool:
        """Whether the nodes are the volume's voxels."""
        return math.isclose(self.node_size, self.voxel_size, rel_tol=1e-6)

    @property
    def dimensions(self) -> tuple[int, int, int]:
        """Number of nodes along x, y and z."""
        nz, ny, nx = self.means.shape
        return nx, ny, nz

    @property
    def extent(self) -> Triple:
        """Distance between the first and the last node along x, y and z."""
        return extent_of(self.dimensions, self.spacing)

    @property
    def radius(self) -> float:
        """Radius of the bounding sphere: half, up to rounding."""
        return float(np.linalg.norm(self.extent)) / 2

    @property
    def node_size(self) -> float:
        """Geometric mean of the spacing."""
        return math.prod(self.spacing) ** (1 / 3)


def coarse_shape(dimensions: tuple[int, int, int], most: int) -> tuple[int, int, int]:
    """Nodes along x, y and z for a volume of these dimensions, and at most about `most`.

    All axes are coarsened by the same factor, but for those that are short already. A volume
    that takes no more bytes without spreads is kept whole, and has none.
    """
    counts = np.array(dimensions, dtype=float)
    if counts.prod() <= most * NODE_BYTES:
        return dimensions
    low, high = 1.0, float(counts.max())
    for _ in range(60):
        factor = math.sqrt(low * high)
        fits = np.maximum(counts / factor, 2).round().prod() <= most
        low, high = (low, factor) if fits else (factor, high)
    x, y, z = (int(n) for n in np.maximum(counts / high, 2).round())
    return x, y, z


def _planes(volume: Volume) -> Iterator[NDArray[np.float32]]:
    """Yield planes along z as float32, with the scalar range mapped to [0, 1]."""
    return (plane.astype(np.float32) for plane in unit_planes(volume))


def _averaging(voxels: int, nodes: int) -> sparse.csr_matrix:
    """Matrix (nodes, voxels) of means over boxes as wide as the distance between nodes."""
    width = (voxels - 1) / (nodes - 1)
    middle = np.arange(nodes)[:, None] * width
    voxel = np.arange(voxels)
    first = np.maximum(middle - width / 2, voxel - 0.5)
    weights = (np.minimum(middle + width / 2, voxel + 0.5) - first).clip(0)
    return sparse.csr_matrix((weights / weights.sum(1, keepdims=True)).astype(np.float32))


def _enlarging(voxels: int, nodes: int) -> sparse.csr_matrix:
    """Matrix (voxels, nodes) of linear interpolation at the voxels."""
    place = np.arange(voxels)[:, None] * ((nodes - 1) / (voxels - 1))
    return sparse.csr_matrix((1 - abs(place - np.arange(nodes))).clip(0).astype(np.float32))


def _averaged(
    planes: Iterable[NDArray[np.float32]], averages: list[sparse.csr_matrix]
) -> NDArray[np.float32]:
    """Average a volume given by its planes, along all axes; one plane in memory at a time."""
    along_x, along_y, along_z = averages
    total = np.zeros((along_z.shape[0], along_y.shape[0], along_x.shape[0]), dtype=np.float32)
    by_plane = along_z.tocsc()
    for index, plane in enumerate(planes):
        part = (along_x @ (along_y @ plane).T).T
        column = slice(by_plane.indptr[index], by_plane.indptr[index + 1])
        for node, weight in zip(by_plane.indices[column], by_plane.data[column], strict=True):
            total[node] += weight * part
    return total


def _enlarged(
    means: NDArray[np.float32], enlargements: list[sparse.csr_matrix]
) -> Iterator[NDArray[np.float32]]:
    """Interpolate nodes at each plane of the volume."""
    along_x, along_y, along_z = enlargements
    for index in range(along_z.shape[0]):
        row = slice(along_z.indptr[index], along_z.indptr[index + 1])
        nodes, weights = along_z.indices[row], along_z.data[row]
        plane = np.tensordot(weights, means[nodes], axes=1)
        yield (along_x @ (along_y @ plane).T).T
