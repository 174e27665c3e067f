"""The volumes that a TIFF file holds, by tifffile's series, and the reading of one of them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from model.volume_files.checks import check_grid, check_present, damaged, truncated, unsupported
from model.volume_files.progress import counted

if TYPE_CHECKING:
    from tifffile import TiffFile, TiffPageSeries

GREATEST_RATIO = 1 << 14
"""Largest ratio of pixels to their bytes in the file that a compression is believed."""

UNCOMPRESSED = 1


@dataclass(frozen=True, eq=False)
class Stack:
    """A volume, or several of equal size, within a series of pages.

    Attributes
    ----------
    depth : int or None
        The series' axis that is z; None for a flat image.
    others : tuple of int
        Axes along which there are several volumes: time, channels, positions.
    """

    series: TiffPageSeries
    depth: int | None
    others: tuple[int, ...]

    @property
    def axes(self) -> str:
        """One letter for each of the series' axes, slowest first."""
        return self.series.axes

    @property
    def dimensions(self) -> tuple[int, int, int]:
        """Voxels along x, y and z."""
        shape = self.series.shape
        nz = 1 if self.depth is None else shape[self.depth]
        return int(shape[self.axes.index("X")]), int(shape[self.axes.index("Y")]), int(nz)

    @property
    def samples(self) -> int:
        """Number of values of each voxel."""
        return int(self.series.shape[self.axes.index("S")]) if "S" in self.axes else 1

    @property
    def dtype(self) -> np.dtype[np.generic]:
        """Type of the voxels once they are read, in native byte order."""
        stored = np.dtype(self.series.dtype)
        if stored.kind == "b":
            return np.dtype(np.uint8)
        return np.dtype(np.float32) if stored == np.float16 else stored.newbyteorder("=")

    def count(self, letters: str) -> int:
        """Return the number of volumes along the other axes of these letters."""
        return math.prod(self.series.shape[k] for k in self.others if self.axes[k] in letters)

    @property
    def is_volume(self) -> bool:
        """False for a flat image."""
        return min(self.dimensions) > 1


def all_series(tiff: TiffFile) -> list[TiffPageSeries]:
    """Return tifffile's series, but those by ImageJ with the pages that the file lists.

    Where all series are single images, those of the size that most have are one series.

    Of a stack by ImageJ tifffile reads the first page and takes the others to lie behind it.
    Other programs copy ImageJ's description, but put their pages elsewhere.
    """
    import tifffile

    found = list(tiff.series)
    if len(found) > 1 and all(len(series.shape) == 2 for series in found):
        return _gathered(found)
    if not found or found[0].kind != "imagej" or len(tiff.pages) < 2:
        return found
    series = found[0]
    if series.dataoffset is None:
        return found
    first, second = tiff.pages.first, tiff.pages[1]
    count = math.prod(n for n, axis in zip(series.shape, series.axes, strict=True) if axis in "TZC")
    if not first.dataoffsets or not second.dataoffsets or len(tiff.pages) != count:
        return found
    if second.dataoffsets[0] == first.dataoffsets[0] + first.nbytes:
        return found
    return [
        tifffile.TiffPageSeries(
            list(tiff.pages), series.shape, series.dtype, series.axes, kind="imagej"
        )
    ]


def _gathered(found: list[TiffPageSeries]) -> list[TiffPageSeries]:
    """Put the single images of the most frequent size and type into one series, in order."""
    import tifffile

    kinds = Counter((series.shape, series.dtype) for series in found)
    kind, count = kinds.most_common(1)[0]
    if count < 2:
        return found
    alike = [series for series in found if (series.shape, series.dtype) == kind]
    others = [series for series in found if (series.shape, series.dtype) != kind]
    pages = [page for series in alike for page in series.pages]
    whole = tifffile.TiffPageSeries(pages, (count, *kind[0]), kind[1], "I" + alike[0].axes)
    return [whole, *others]


def stack_of(series: TiffPageSeries) -> Stack:
    """Tell which of a series' axes is z.

    It is the one of that name or, where there is none, the one next to the images' own two
    among those that are not named, then time, then channels: many programs name slices so.
    """
    axes, shape = series.axes, series.shape
    inner = {axes.find(letter) for letter in "YXS"}
    outer = [k for k in range(len(axes)) if k not in inner and shape[k] > 1]
    depth = next((k for k in outer if axes[k] == "Z"), None)
    for letters in ("", "T", "C"):
        if depth is None:
            depth = next(
                (k for k in reversed(outer) if (axes[k] in letters or not letters)
                 and (letters or axes[k] not in "TC")),
                None,
            )  # fmt: skip
    return Stack(series, depth, tuple(k for k in outer if k != depth))


def check_pages(path: Path, stack: Stack, flat: bool = False) -> None:
    """Check that the file has the bytes of a stack's pixels, before memory is taken.

    Parameters
    ----------
    flat : bool
        Whether a single slice will do.
    """
    series = stack.series
    if np.dtype(series.dtype).kind not in "biuf":
        raise unsupported(
            path, f"a TIFF of {series.dtype} voxels", "save its magnitude, for example in Fiji"
        )
    if not flat:
        check_grid(path, stack.dimensions, stack.dtype, stack.samples)
    if series.dataoffset is not None:
        return
    for page in series.pages:
        if page is None:
            raise damaged(path, "some of its pages cannot be found")
        size = page.parent.filehandle.size
        offsets, lengths = page.dataoffsets, page.databytecounts
        if len(offsets) != len(lengths) or not all(
            offset > 0 and length > 0 for offset, length in zip(offsets, lengths, strict=True)
        ):
            raise damaged(path, "a page's strips do not add up")
        if any(o + n > size for o, n in zip(offsets, lengths, strict=True)):
            raise truncated(path, "a page's pixels lie beyond its end")
        keyframe: Any = page.keyframe
        is_plain = keyframe.compression == UNCOMPRESSED
        need = keyframe.size * keyframe.bitspersample // 8
        if sum(lengths) * (1 if is_plain else GREATEST_RATIO) < need:
            raise damaged(path, "a page has fewer pixels than its size says")


def read_stack(path: Path, stack: Stack, index: Mapping[int, int]) -> NDArray[np.generic]:
    """Read one volume of a stack.

    Parameters
    ----------
    index : dict of int
        Number of the volume along each of the stack's other axes.

    Returns
    -------
    ndarray, shape (nz, ny, nx) or (nz, ny, nx, samples)
        Native byte order.
    """
    nx, ny, nz = stack.dimensions
    values = np.empty((nz, ny, nx, stack.samples), stack.dtype)
    series: Any = stack.series
    axes = stack.axes
    inner = "".join(letter for letter in axes if letter in "YXS")
    is_planar = axes.endswith(inner) and inner in ("YX", "YXS", "SYX")
    planes = list(_plane_numbers(stack, index)) if is_planar else []
    if is_planar and series.dataoffset is not None and inner != "SYX":
        _read_contiguous(path, stack, planes, values)
    elif is_planar and len(series.pages) * _plane_size(stack) == series.size:
        for target, number in zip(values, counted("slices read", planes), strict=True):
            pixels = series.pages[number].asarray(maxworkers=1)
            _put(target, pixels, inner)
    else:
        whole = series.asarray(maxworkers=1)
        fixed = tuple(index.get(k, slice(None)) for k in range(len(axes)))
        kept = "".join(axes[k] for k in range(len(axes)) if k not in index)
        part = whole[tuple(f if k in index else slice(None) for k, f in enumerate(fixed))]
        order = [kept.index("Y"), kept.index("X")]
        depth = [] if stack.depth is None else [kept.index(axes[stack.depth])]
        samples = [kept.index("S")] if "S" in kept else []
        part = np.transpose(part, [*depth, *order, *samples])
        values[...] = part.reshape(values.shape)
    return values if stack.samples > 1 else values[..., 0]


def _plane_size(stack: Stack) -> int:
    nx, ny, _ = stack.dimensions
    return nx * ny * stack.samples


def _plane_numbers(stack: Stack, index: Mapping[int, int]) -> Iterator[int]:
    """Yield the number of each slice among all planes of the series, in its order."""
    shape = stack.series.shape
    outer = [k for k in range(len(shape)) if stack.axes[k] not in "YXS"]
    for z in range(stack.dimensions[2]):
        place = [z if k == stack.depth else index.get(k, 0) for k in outer]
        number = 0
        for k, at in zip(outer, place, strict=True):
            number = number * int(shape[k]) + at
        yield number


def _read_contiguous(
    path: Path, stack: Stack, planes: Sequence[int], values: NDArray[np.generic]
) -> None:
    """Read planes that lie in the file as they lie in memory."""
    stored = np.dtype(stack.series.dtype).newbyteorder(stack.series.keyframe.parent.byteorder)
    size = _plane_size(stack) * stored.itemsize
    offset = int(stack.series.dataoffset or 0)
    with path.open("rb") as file:
        buffer = np.empty(values.shape[1:], stored)
        for target, number in zip(values, counted("slices read", planes), strict=True):
            file.seek(offset + number * size)
            check_present(path, file.readinto(buffer.view(np.uint8).data), size)
            target[...] = buffer


def _put(target: NDArray[Any], pixels: NDArray[Any], inner: str) -> None:
    """Put a page's pixels into a slice."""
    if inner == "SYX":
        pixels = np.moveaxis(pixels, 0, -1)
    if pixels.size != target.size:
        raise ValueError(f"a page of {pixels.dtype} {pixels.shape}")
    target[...] = pixels.reshape(target.shape)
