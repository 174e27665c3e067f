"""The mask: which voxels of a volume are shown under any TF."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.scene.crop import CropBox
from model.scene.volume import Volume


@dataclass(frozen=True)
class Mask:
    """The voxels that are shown; all others are transparent under any TF.

    Between shown and hidden voxels, the opacity falls linearly, and values are those of the shown
    ones; between labels it is cut. Some shown voxels may be no more than an edge around the others,
    where a surface fades by the TF.
    """

    shape: tuple[int, int, int]  # of the volume's voxels (nz, ny, nx)
    bits: bytes = field(repr=False)  # 1 for each shown voxel, packed by `numpy.packbits`
    edge: bytes = field(default=b"", repr=False)  # the same for the edge; empty without one

    @classmethod
    def of(cls, shown: NDArray[np.bool_]) -> Mask | None:
        """Return the mask of shown voxels (nz, ny, nx), None for all; `TfscopeError` for none."""
        nz, ny, nx = shown.shape
        return cls.of_packed((nz, ny, nx), np.packbits(shown))

    @classmethod
    def of_packed(cls, shape: tuple[int, int, int], bits: NDArray[np.uint8]) -> Mask | None:
        """Return the mask of packed bits; bits after the last voxel do not count."""
        unused = 8 * len(bits) - math.prod(shape)
        last = bits[-1] >> unused << unused
        if last == 255 >> unused << unused and (bits[:-1] == 255).all():
            return None
        if not (last or bits[:-1].any()):
            raise TfscopeError("Nothing would be left to show, so the image stays as it is.")
        return cls(shape, bits[:-1].tobytes() + last.tobytes())

    def with_edge(self, edge: NDArray[np.uint8]) -> Mask:
        """Return the mask whose edge are those of its voxels that packed bits select."""
        kept = np.frombuffer(self.bits, np.uint8) & edge
        return replace(self, edge=kept.tobytes() if kept.any() else b"")

    @property
    def exact(self) -> Mask:
        """The mask without its edge."""
        return Mask(self.shape, (np.frombuffer(self.bits, np.uint8) & ~self.edge_bits).tobytes())

    @property
    def edge_bits(self) -> NDArray[np.uint8]:
        """The packed bits of the edge, 0 without one."""
        return np.frombuffer(self.edge or bytes(len(self.bits)), np.uint8)

    @property
    def shown(self) -> NDArray[np.bool_]:
        """The shown voxels (nz, ny, nx), unpacked."""
        packed = np.frombuffer(self.bits, dtype=np.uint8)
        bits = np.unpackbits(packed, count=math.prod(self.shape))
        return bits.view(np.bool_).reshape(self.shape)

    def within(self, box: CropBox) -> CropBox:
        """Return the part of a box that holds the shown voxels; all of it if that is too thin."""
        shown, low, high = self.shown, list(box.low), list(box.high)
        for axis, count in enumerate(self.shape[::-1]):
            others = tuple(n for n in range(3) if n != 2 - axis)
            places = np.flatnonzero(shown.any(axis=others)) / max(count - 1, 1)
            low[axis], high[axis] = max(low[axis], places[0]), min(high[axis], places[-1])
        try:
            return CropBox((low[0], low[1], low[2]), (high[0], high[1], high[2]))
        except TfscopeError:
            return box

    def shows(
        self, x: NDArray[np.integer], y: NDArray[np.integer], z: NDArray[np.integer]
    ) -> NDArray[np.bool_]:
        """Return which voxels are shown, given their numbers along each axis."""
        _, ny, nx = self.shape
        number = x + nx * (y + ny * z)
        bytes_ = np.frombuffer(self.bits, dtype=np.uint8)[number >> 3]
        return np.asarray((bytes_ >> (7 - (number & 7))) & 1).astype(bool)


def masked_voxels(volume: Volume, mask: Mask) -> NDArray[np.bool_]:
    """Return the voxels that a mask hides; :class:`TfscopeError` for another grid."""
    if mask.shape != volume.voxels.shape:
        sizes = (" × ".join(map(str, shape[::-1])) for shape in (mask.shape, volume.voxels.shape))
        raise TfscopeError(
            f"{volume.name}: the mask has {next(sizes)} voxels, but the volume has "
            f"{next(sizes)}; make a new mask."
        )
    return ~mask.shown


def grown(voxels: NDArray[np.bool_], shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return voxels and the hidden ones (not `shown`) that touch them, if only by a corner."""
    grown = voxels
    for axis in range(3):
        before, grown = np.moveaxis(grown, axis, 0), grown.copy()
        after = np.moveaxis(grown, axis, 0)
        after[1:] |= before[:-1]
        after[:-1] |= before[1:]
    return grown & (voxels | ~shown)
