"""Pieces: voxels connected to a point of a volume, to be shown alone or cut away."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.rendering.ray_places import most_visible, values_at
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask, grown, masked_voxels
from model.scene.transfer_function import TF_SAMPLES, OpacityTF, Range
from model.scene.volume import Volume
from model.volume_files.masks import LabelMap

LEAST_OPACITY = 0.005  # share of the TF's largest opacity from which values count as visible
BAND = 0.25  # share of a band's largest opacity at which the band ends
SKIN = 0.1  # least size of a listed band's piece, as a share of that of the TF's band
ALIKE = 0.98  # share of the connected voxels from which a band is not a separate piece
LEAST_COUNT = 8  # voxels of a piece: two along each axis, as noise makes smaller ones
ALL_AROUND = 0.9  # least share of the voxels around a piece whose values are not the piece's
NEAR = 2  # voxels from a point, along each axis, within which its piece begins
LAST, TINY = TF_SAMPLES - 1, 1e-12
MOST_VOXELS = 1 << 24  # most cells of the grid for the search; larger volumes are thinned


@dataclass(frozen=True)
class Piece:
    """Voxels that are connected to a point.

    The mask's edge is one layer around them that belongs to no other piece: there the surface fades
    by the TF, without a cut. What is more opaque than the surface, such as bone beside a vessel, is
    no part of it.
    """

    voxels: Mask
    count: int  # number of connected voxels
    among: int  # number of all visible voxels with its values
    values: Range | None  # values of their band; None for all visible values

    def left(self, mask: Mask | None, alone: bool) -> Mask | None:
        """Return a mask limited to the piece, or without it."""
        bits, edge = np.frombuffer(self.voxels.bits, np.uint8), self.voxels.edge_bits
        bits, edge = (bits, edge) if alone else (~bits, np.zeros_like(edge))
        if mask is not None:
            bits = bits & np.frombuffer(mask.bits, np.uint8)
            edge = edge | mask.edge_bits
        left = Mask.of_packed(self.voxels.shape, bits)
        return None if left is None else left.with_edge(edge)


def pieces_under(
    volume: Volume, inputs: SceneInputs, at: tuple[float, float], listed: Sequence[Range] = ()
) -> tuple[Piece, ...]:
    """Return the pieces at the most visible point of a pixel; see :func:`pieces_at`."""
    point = most_visible(volume, inputs, at, listed)
    return () if point is None else pieces_at(volume, inputs, point, listed)


def pieces_at(
    volume: Volume, inputs: SceneInputs, place: NDArray[np.float64], listed: Sequence[Range] = ()
) -> tuple[Piece, ...]:
    """Return the voxels connected to a point (3,), in fractions of the volume's extent.

    The first piece has voxels that touch by their faces and are visible under the scene's TF, mask,
    crop box and clipping plane. The second, if different, has only those of the point's band of
    values: a listed one, unless that is only the skin of a peak of the TF. Above 256 voxels cubed
    the search uses a coarser grid. Of labels, pieces have any size. Raises :class:`TfscopeError` if
    nothing is visible, or nothing large enough.
    """
    last = np.array(volume.voxels.shape) - 1
    first, end = np.rint(inputs.part.corners(volume)[:, ::-1]).astype(int)
    end = np.maximum(first, end)
    part = tuple(slice(a, b + 1) for a, b in zip(first, end, strict=True))
    voxels, shown = volume.shown[part], np.ones(1, dtype=bool)
    if inputs.mask is not None:
        shown = ~masked_voxels(volume, inputs.mask.exact)[part]
    if volume.hidden is not None:
        shown = shown & ~volume.hidden[part]
    if inputs.clip is not None:
        *normal, level = inputs.part.plane(volume).tolist()
        x, y, z = (
            share * np.arange(along.start, along.stop, dtype=np.float32)
            for share, along in zip(normal, part[::-1], strict=True)
        )
        shown = shown & (x + y[:, None] + z[:, None, None] <= level)
    at = np.rint(place[::-1] * last).astype(int)
    seed = np.clip(at, first, end) - first
    is_cut = abs(at - first - seed).max() > NEAR
    opacity = _opacity(inputs.opacity_tf, volume)
    runs = _runs(opacity > 0)

    def piece_of(
        visible: NDArray[np.bool_], start: NDArray[np.int64], band: tuple[int, int] | None
    ) -> Piece:
        inside, box = _connected(visible, start)
        around = grown(inside, visible[box]) & ~inside
        whole, edge = np.zeros((2, *volume.voxels.shape), dtype=bool)
        whole[part][box] = inside
        edge[part][box] = around & _fading(voxels[box], band or (0, LAST), opacity, volume)
        count, ends = int(np.count_nonzero(inside)), np.array(band or (0, 0))
        values = None if band is None else tuple((lo + (hi - lo) * ends / LAST).tolist())
        return Piece(_mask_of(whole, edge), count, int(np.count_nonzero(visible)), values)

    visible = _of_values(voxels, runs, volume) & shown
    low = np.maximum(seed - NEAR, 0)
    near = np.argwhere(visible[tuple(map(slice, low, seed + NEAR + 1))]) + low
    if is_cut or not (len(near) or np.broadcast_to(shown, visible.shape)[tuple(seed)]):
        raise TfscopeError("This place is hidden or cut away; click something that is visible.")
    if not len(near):
        raise TfscopeError("The TF shows nothing here; click something that is visible.")
    near = near[np.argsort(((near - seed) ** 2).sum(axis=1), kind="stable")]
    lo, hi = volume.scalar_range
    found = [piece_of(visible, near[0], None)]
    # The value at the point and those of voxels: interpolated values may belong to neither.
    values = np.append(
        values_at(volume, place[None], inputs.is_nearest(volume)), voxels[tuple(near.T)]
    )
    bins = _bins(values, volume)

    def part_of(bands: Iterable[tuple[int, int]]) -> list[Piece]:
        for band in bands:
            within = near[(bins[1:] >= band[0]) & (bins[1:] <= band[1])]
            if runs == [band]:
                break
            if len(within):
                of_band = _of_values(voxels, [band], volume) & visible
                return [piece_of(of_band, within[0], band)]
        return []

    ends = np.rint(LAST * (np.reshape(listed, (-1, 2)) - lo) / (hi - lo)).astype(int).tolist()
    own = part_of((low, high) for low, high in ends if low <= bins[0] <= high)
    parts = own + part_of(_band_around(opacity, int(bin_)) for bin_ in bins[:2])
    found += [part for part in parts if part.count >= SKIN * parts[-1].count][:1]
    found = found if found[-1].count < ALIKE * found[0].count else found[:1]
    least = 1 if volume.file.is_labels else LEAST_COUNT
    large = tuple(piece for piece in found if piece.count >= least)
    if not large:
        raise TfscopeError(
            "What is connected here is too small, perhaps noise; click another place."
        )
    return large


def mask_of(
    labels: LabelMap, chosen: Collection[float], volume: Volume, opacity_tf: OpacityTF
) -> Mask | None:
    """Return the mask that shows labels, a file's only one with the edge that a piece has."""
    mask = labels.mask(chosen)
    if mask is None or len(labels.values) > 1:
        return mask
    return with_edge(mask, volume, opacity_tf)


def with_edge(mask: Mask, volume: Volume, opacity_tf: OpacityTF) -> Mask:
    """Return a mask with the edge of a piece, if it is one of visible or a band's values.

    What was outlined by hand has its values around it, too, and stays as it is.
    """
    piece, voxels = mask.shown, volume.shown
    values, around = voxels[piece], grown(piece, piece) & ~piece
    ends, opacity = (values.min(), values.max()), _opacity(opacity_tf, volume)
    is_visible = _of_values(voxels, _runs(opacity > 0), volume)
    edge = around & ((voxels < ends[0]) | (voxels > ends[1]) | ~is_visible)
    if edge.sum() < ALL_AROUND * around.sum():
        return mask
    first, last = _bins(np.array(ends), volume)
    return _mask_of(piece, edge & _fading(voxels, (first, last), opacity, volume))


def _mask_of(piece: NDArray[np.bool_], edge: NDArray[np.bool_]) -> Mask:
    nz, ny, nx = piece.shape
    both = (np.packbits(each).tobytes() for each in (piece | edge, edge))
    return Mask((nz, ny, nx), *both)


def _fading(
    voxels: NDArray[np.generic], band: tuple[int, int], opacity: NDArray[np.float64], volume: Volume
) -> NDArray[np.bool_]:
    """Return which voxels are no more opaque than the nearer end of a band of bins, or its peak.

    Those are as opaque as its peak only if their values are near the band.
    """
    if volume.file.is_labels:
        # Between labels nothing fades.
        return np.zeros(voxels.shape, dtype=bool)
    first, last = band
    fades = opacity <= np.where(np.arange(len(opacity)) < first, opacity[first], opacity[last])
    # The band's own material has values beyond it, too, in which its surface would have holes.
    near = (last - first) // 2
    beyond = slice(max(first - near, 0), last + near + 1)
    fades[beyond] |= opacity[beyond] <= opacity[first : last + 1].max()
    return _of_values(voxels, _runs(fades), volume)


def _opacity(tf: OpacityTF, volume: Volume) -> NDArray[np.float64]:
    """Return a TF's samples, 0 for values that do not count as visible."""
    opacity = tf.sample(volume.scalar_range).astype(np.float64)
    opacity[opacity < max(LEAST_OPACITY * opacity.max(), TINY)] = 0
    return opacity


def _bins(values: NDArray[np.generic], volume: Volume) -> NDArray[np.int64]:
    lo, hi = volume.scalar_range
    shares = np.clip((values.astype(np.float64) - lo) / (hi - lo), 0, 1)
    return np.rint(LAST * shares).astype(np.int64)


def _runs(bins: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and last bins of each run of selected ones."""
    steps = np.diff(np.concatenate([[0], bins.astype(np.int8), [0]]))
    return [(int(a), int(b) - 1) for a, b in np.flatnonzero(steps).reshape(-1, 2)]


def _band_around(opacity: NDArray[np.float64], bin_: int) -> tuple[int, int]:
    """First and last bin of the band around a value: up its flank to a peak, and down again."""
    padded = np.pad(opacity, 1, constant_values=-1)
    peak = bin_
    while padded[peak : peak + 3].max() > opacity[peak]:
        peak += int(np.argmax(padded[peak : peak + 3])) - 1
    low = np.flatnonzero(padded < max(min(opacity[bin_], BAND * opacity[peak]), TINY)) - 1
    return int(low[low <= peak].max()) + 1, int(low[low >= peak].min()) - 1


def _of_values(
    voxels: NDArray[np.generic], runs: list[tuple[int, int]], volume: Volume
) -> NDArray[np.bool_]:
    """Return the voxels whose nearest bin is selected; the ends include values beyond the range."""
    lo, hi = volume.scalar_range
    found = np.zeros(voxels.shape, dtype=bool)
    for first, last in runs:
        low = -np.inf if first == 0 else lo + (hi - lo) * (first - 0.5) / LAST
        high = np.inf if last == LAST else lo + (hi - lo) * (last + 0.5) / LAST
        if voxels.dtype.kind != "f":
            # Comparisons with floats would take ten times longer.
            limits = np.iinfo(voxels.dtype.name)
            low = int(np.ceil(max(low, limits.min)))
            high = int(min(np.ceil(high) - 1, limits.max))
        for plane, out in zip(voxels, found, strict=True):
            out |= (plane >= low) & (plane <= high)
    return found


def _connected(
    visible: NDArray[np.bool_], seed: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], tuple[slice, ...]]:
    """Return the visible voxels connected to one, and their bounding box with a margin."""
    from scipy.ndimage import find_objects, label

    factor = 1
    while np.prod(-(-np.array(visible.shape) // factor)) > MOST_VOXELS:
        factor += 1
    cells = visible if factor == 1 else _thinned(visible, factor)
    cell = tuple(seed // factor)
    cells[cell] = True
    labels, _ = label(cells)
    inside = labels == labels[cell]
    (found,) = find_objects(inside.view(np.uint8))
    box = tuple(slice(max(each.start - 1, 0), each.stop + 1) for each in found)
    inside, cells = inside[box], cells[box]
    if factor == 1:
        return inside, box
    # Cells at the surface have few visible voxels: those of no other piece are added.
    inside = grown(inside, cells)
    fine = tuple(slice(each.start * factor, each.stop * factor) for each in box)
    for axis in (2, 1, 0):
        inside = np.repeat(inside, factor, axis=axis)
    shown = visible[fine]
    return shown & inside[tuple(map(slice, shown.shape))], fine


def _thinned(visible: NDArray[np.bool_], factor: int) -> NDArray[np.bool_]:
    """Return the cells of this many voxels along each axis that are at least half visible."""
    counts = visible.view(np.uint8)
    for axis in range(3):
        along = np.moveaxis(counts, axis, 0)
        total = np.zeros((-(-len(along) // factor), *along.shape[1:]), np.uint16)
        for first in range(factor):
            some = along[first::factor]
            total[: len(some)] += some
        counts = np.moveaxis(total, 0, axis)
    return counts * 2 >= factor**3
