"""Pieces: what is connected to a place of a volume, to be shown alone or cut away."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask, hidden_voxels
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.volume import Triple, Volume

LEAST_OPACITY = 0.005  # part of the TF's largest opacity from which on values count as visible
BAND = 0.25  # part of the largest opacity of a band of values at which that band ends
ALIKE = 0.98  # part of all that is connected from which on a band of values is no other piece
MOST_VOXELS = 1 << 24  # of the grid on which pieces are told apart; larger volumes are thinned


@dataclass(frozen=True)
class Piece:
    """Voxels that are connected to a place.

    `voxels` are one more around them, which belong to no other piece: there the TF lets the
    surface fade, and no edge is seen where the piece touches nothing.
    """

    voxels: Mask
    count: int  # of those that are connected
    values: Range | None  # of the band that they are of; None for all visible values

    def alone(self, mask: Mask | None) -> Mask | None:
        """Return the mask that shows of what a mask shows only the piece."""
        shown = self.voxels.shown
        return Mask.of(shown if mask is None else shown & mask.shown)

    def cut(self, mask: Mask | None) -> Mask | None:
        """Return the mask that shows all of what a mask shows but the piece."""
        others = ~self.voxels.shown
        return Mask.of(others if mask is None else others & mask.shown)


def pieces_at(volume: Volume, inputs: SceneInputs, place: Triple) -> tuple[Piece, ...]:
    """Return what is connected to a place, given as fractions of the volume's extent.

    The first piece has voxels that touch by their faces, and whose values are visible under the
    scene's TF, mask and crop box. The second has only those of the band of values that the place
    is in; there is none where that makes no difference. Above 256 voxels cubed they are told apart
    on a coarser grid. Raises :class:`TfscopeError` where nothing is visible.
    """
    last = np.array(volume.voxels.shape) - 1
    crop = inputs.crop or CropBox()
    first, end = (
        np.rint(np.array(corner)[::-1] * last).astype(int) for corner in (crop.low, crop.high)
    )
    part = tuple(slice(a, max(b, a) + 1) for a, b in zip(first, end, strict=True))
    voxels, hidden = volume.voxels[part], hidden_voxels(volume, inputs.mask)
    shown = None if hidden is None else ~hidden[part]
    at = np.array(place)[::-1] * last
    seed = np.clip(np.rint(at).astype(int) - first, 0, np.array(voxels.shape) - 1)
    opacity = _bins(volume, inputs)
    runs = _runs(opacity)

    def shown_of(bins: list[tuple[int, int]]) -> NDArray[np.bool_]:
        found = _of_values(voxels, bins, volume)
        return found if shown is None else found & shown

    def piece_of(visible: NDArray[np.bool_], start: NDArray[np.int64], band: Range | None) -> Piece:
        inside, box = _connected(visible, start)
        whole = np.zeros(volume.voxels.shape, dtype=bool)
        whole[part][box] = _grown(inside) & ~(visible[box] & ~inside)
        return Piece(Mask.packed(whole), int(np.count_nonzero(inside)), band)

    visible = shown_of(runs)
    near = _near(visible, seed)
    all_visible = piece_of(visible, near[0], None)
    bins = np.array([_bin_of(value, volume) for value in voxels[tuple(near.T)].tolist()])
    band = _band_around(opacity, _bin_of(_value_at(volume, at, inputs.is_nearest(volume)), volume))
    within = near[(bins >= band[0]) & (bins <= band[1])]
    if not len(within):
        # Between two voxels there may be values that neither of them has.
        band, within = _band_around(opacity, int(bins[0])), near
    if runs == [band]:
        return (all_visible,)
    in_band = piece_of(shown_of([band]), within[0], _values_of(band, volume))
    return (all_visible, in_band)[: 1 + (in_band.count < ALIKE * all_visible.count)]


def _bins(volume: Volume, inputs: SceneInputs) -> NDArray[np.float64]:
    """Opacities at the bins of the scalar range, those that count as nothing set to 0."""
    opacity = inputs.opacity_tf.sample(volume.scalar_range).astype(np.float64)
    return np.where(opacity >= max(LEAST_OPACITY * opacity.max(), 1e-9), opacity, 0.0)


def _runs(opacity: NDArray[np.float64]) -> list[tuple[int, int]]:
    """First and last bins of the values that are visible without a gap."""
    steps = np.diff(np.concatenate([[0], (opacity > 0).astype(np.int8), [0]]))
    ends = np.flatnonzero(steps).reshape(-1, 2)
    return [(int(first), int(end) - 1) for first, end in ends]


def _band_around(opacity: NDArray[np.float64], bin_: int) -> tuple[int, int]:
    """First and last bin of the band around a value: up its flank to a peak, and down again."""
    peak = bin_
    while True:
        around = [b for b in (peak - 1, peak + 1) if 0 <= b < TF_SAMPLES]
        best = max(around, key=lambda b: opacity[b])
        if opacity[best] <= opacity[peak]:
            break
        peak = best
    ends_at = max(min(opacity[bin_], BAND * opacity[peak]), 1e-12)
    first = last = peak
    while first > 0 and opacity[first - 1] >= ends_at:
        first -= 1
    while last < TF_SAMPLES - 1 and opacity[last + 1] >= ends_at:
        last += 1
    return first, last


def _value_at(volume: Volume, at: NDArray[np.float64], is_nearest: bool) -> float:
    """Scalar value at a place (z, y, x) in voxels."""
    from scipy.ndimage import map_coordinates

    order = 0 if is_nearest else 1
    found = map_coordinates(
        volume.voxels, at[:, None], np.float64, order=order, mode="nearest", prefilter=False
    )
    return float(found[0])


def _bin_of(value: float, volume: Volume) -> int:
    lo, hi = volume.scalar_range
    return int(np.rint(np.clip((value - lo) / (hi - lo), 0, 1) * (TF_SAMPLES - 1)))


def _values_of(run: tuple[int, int], volume: Volume) -> Range:
    """Values in the middle of the first and the last of some bins."""
    lo, hi = volume.scalar_range
    first, last = (lo + bin_ * (hi - lo) / (TF_SAMPLES - 1) for bin_ in run)
    return first, last


def _of_values(
    voxels: NDArray[np.generic], runs: list[tuple[int, int]], volume: Volume
) -> NDArray[np.bool_]:
    """Return which voxels are nearest to some bins; those beyond the range count for its ends."""
    lo, hi = volume.scalar_range
    half = (hi - lo) / (TF_SAMPLES - 1) / 2
    found = np.zeros(voxels.shape, dtype=bool)
    for run in runs:
        low, high = _values_of(run, volume)
        low = -np.inf if run[0] == 0 else low - half
        high = np.inf if run[1] == TF_SAMPLES - 1 else high + half
        if voxels.dtype.kind != "f":
            # Comparisons with floats would take ten times as long.
            limits = np.iinfo(voxels.dtype.name)
            low = int(np.ceil(max(low, limits.min)))
            high = int(min(np.ceil(high) - 1, limits.max))
        for plane, out in zip(voxels, found, strict=True):
            out |= (plane >= low) & (plane <= high)
    return found


def _near(visible: NDArray[np.bool_], seed: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the visible voxels (n, 3) up to two from one, the nearest first."""
    low = np.maximum(seed - 2, 0)
    around = np.argwhere(visible[tuple(map(slice, low, seed + 3))]) + low
    if not len(around):
        raise TfscopeError("Nothing that the TF shows is here; click what is to be taken.")
    return np.asarray(around[np.argsort(((around - seed) ** 2).sum(axis=1), kind="stable")])


def _connected(
    visible: NDArray[np.bool_], seed: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], tuple[slice, ...]]:
    """Return the visible voxels that are connected to one of them, and the box around them.

    Along each axis there is a voxel more on both sides of the box, where the grid has one.
    """
    from scipy.ndimage import label

    factor = 1
    while np.prod(-(-np.array(visible.shape) // factor)) > MOST_VOXELS:
        factor += 1
    cells = visible if factor == 1 else _thinned(visible, factor)
    cell = tuple(seed // factor)
    cells[cell] = True
    labels, _ = label(cells)
    inside = labels == labels[cell]
    box = []
    for axis, count in enumerate(cells.shape):
        others = tuple(each for each in range(3) if each != axis)
        seen = np.flatnonzero(inside.any(axis=others))
        box.append(slice(max(int(seen[0]) - 1, 0), min(int(seen[-1]) + 2, count)))
    inside, cells = inside[tuple(box)], cells[tuple(box)]
    if factor == 1:
        return inside, tuple(box)
    # Cells at the surface have few visible voxels: those of no other piece belong to this one.
    inside = _grown(inside) & ~(cells & ~inside)
    fine = tuple(
        slice(part.start * factor, min(part.stop * factor, count))
        for part, count in zip(box, visible.shape, strict=True)
    )
    for axis in (2, 1, 0):
        inside = np.repeat(inside, factor, axis=axis)
    found = visible[fine]
    return found & inside[tuple(slice(count) for count in found.shape)], fine


def _thinned(visible: NDArray[np.bool_], factor: int) -> NDArray[np.bool_]:
    """Return which cells of so many voxels along each axis are visible for a half."""
    counts = visible.view(np.uint8)
    for axis in range(3):
        along = np.moveaxis(counts, axis, 0)
        total = np.zeros((-(-len(along) // factor), *along.shape[1:]), np.uint16)
        for first in range(factor):
            some = along[first::factor]
            total[: len(some)] += some
        counts = np.moveaxis(total, 0, axis)
    return counts * 2 >= factor**3


def _grown(voxels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return voxels and all that touch them, if by a corner only."""
    grown = voxels
    for axis in range(3):
        before, grown = np.moveaxis(grown, axis, 0), grown.copy()
        after = np.moveaxis(grown, axis, 0)
        after[1:] |= before[:-1]
        after[:-1] |= before[1:]
    return grown
