"""TIFF files of one or more volumes, by tifffile."""

from __future__ import annotations

import math
import re
import struct
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError, first_line
from model.scene.volume import Content, FileFacts
from model.volume_files.checks import (
    check_grid,
    check_present,
    damaged,
    log_of,
    not_a,
    times,
    truncated,
    unsupported,
)
from model.volume_files.choice import (
    LARGEST,
    AskedKind,
    Choice,
    chosen,
    chosen_index,
    content,
)
from model.volume_files.grid import Grid, usable_spacing
from model.volume_files.progress import counted
from model.volume_files.tiff_scale import calibrated, channel_names, voxel_scale

if TYPE_CHECKING:
    from tifffile import TiffFile, TiffPageSeries

SUFFIXES = (".tif", ".tiff", ".stk", ".lsm")
MINISWHITE, PALETTE = 0, 3

_HARMLESS = re.compile(r"metadata> raised|subfiletype|GDAL_NODATA|OME series failed to read \d")
"""What tifffile warns of though the pixels are right."""

_HARMLESS_OF_PAGES = re.compile(_HARMLESS.pattern + r"|ImageJ series metadata invalid")
"""The same where the file has several pages."""

_BROKEN_CHAIN = re.compile(r"invalid (page offset|offset to page)")
"""What tifffile says where the file ends before its last page."""

_NAMES = {"ome": "OME-TIFF", "imagej": "TIFF by ImageJ", "stk": "MetaSeries STK", "lsm": "LSM"}


@contextmanager
def opened_tiff(path: Path) -> Iterator[TiffFile]:
    """Open a TIFF file; what tifffile raises, or only warns of, is damage."""
    import tifffile

    with log_of("tifffile") as warnings:
        try:
            with tifffile.TiffFile(path) as tiff:
                if not len(tiff.pages):
                    raise damaged(path, "it has no pages")
                yield tiff
                # A stack that lies behind a single page was cut off, others were only described
                # wrongly.
                is_described = len(tiff.pages) == 1
        except VolumeError:
            if any(_BROKEN_CHAIN.search(warning) for warning in warnings):
                # What is wrong with the pages that are left is only a consequence.
                raise truncated(path, "its list of pages leads beyond its end") from None
            raise
        except (OSError, MemoryError):
            raise
        except tifffile.TiffFileError as error:
            if "not a TIFF" in str(error):
                raise not_a(path, "a TIFF file") from None
            raise damaged(path, first_line(error)) from None
        except struct.error:
            raise truncated(path, "the head of a page lies beyond its end") from None
        except Exception as error:
            # Decoders raise errors of many kinds.
            raise damaged(path, f"its pixels cannot be unpacked: {first_line(error)}") from None
    harmless = _HARMLESS if is_described else _HARMLESS_OF_PAGES
    if serious := [warning for warning in warnings if not harmless.search(warning)]:
        said = re.sub(r"^<tifffile\.\w+ [^>]*> ", "", serious[0])
        raise damaged(path, f"tifffile says '{said.rstrip('.')}'")


def read_tiff(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a volume of a file; of several the largest, or the chosen one."""
    with opened_tiff(path) as tiff:
        stacks = [stack_of(series) for series in all_series(tiff)]
        volumes = [stack for stack in stacks if stack.is_volume]
        if not volumes:
            raise _flat(path, stacks)
        names = [channel_names(tiff, number, s.count("C")) for number, s in enumerate(stacks)]
        channels = dict(zip(map(id, stacks), names, strict=True))
        stack, index, listed = _chosen(path, volumes, choice, channels)
        check_pages(path, stack)
        values = read_stack(path, stack, index)
        missing = _without_data(stack, values)
        values, units, notes = calibrated(tiff, values)
        scale = voxel_scale(tiff, stacks.index(stack))
        spacing, spacing_notes = usable_spacing(scale.spacing)
        notes += _kind_notes(tiff, stack)
        if len(volumes) < len(stacks):
            notes += (f"Flat images were left out: {len(stacks) - len(volumes)}.",)
        return Grid(
            values,
            spacing,
            units=units,
            notes=notes + scale.notes + spacing_notes,
            missing=missing,
            facts=FileFacts(_NAMES.get(stack.series.kind, "TIFF"), scale.unit, contents=listed),
        )


def _flat(path: Path, stacks: list[Stack]) -> VolumeError:
    """Return the error for a file without a volume."""
    sizes = list(dict.fromkeys(times(stack.dimensions[:2]) for stack in stacks))
    if len(stacks) > 1:
        types = ", ".join(dict.fromkeys(str(stack.dtype) for stack in stacks))
        return VolumeError(
            f"{path}: its slices differ in size, type or storage ({', '.join(sizes[:4])} of "
            f"{types}); keep those of one volume together."
        )
    try:
        check_grid(path, stacks[0].dimensions, stacks[0].dtype)
    except VolumeError as error:
        slices = sum(1 for other in path.parent.glob(f"*{path.suffix}") if other.name[0] != ".")
        if slices > 2:
            return VolumeError(
                f"{path}: this is a flat image of {times(stacks[0].dimensions)} pixels, not a "
                f"volume; if it is one of the {slices} slices in its folder, open the folder."
            )
        return error
    return damaged(path, "it has no pages")


def _chosen(
    path: Path, volumes: list[Stack], choice: Choice, channels: dict[int, list[str]]
) -> tuple[Stack, dict[int, int], tuple[Content, ...]]:
    """Return the chosen stack, its volume's number along its other axes, and all contents."""
    names, owners = _series(volumes)
    sizes = [np.prod(stack.dimensions) for stack, _ in owners]
    number = chosen_index(path, "series", names, choice.series, int(np.argmax(sizes)))
    stack, index = owners[number]
    index = dict(index)
    listed: tuple[Content, ...] = tuple(
        content("series", name, owner.dimensions, owner.dtype, each == number)
        for each, (name, (owner, _)) in enumerate(zip(names, owners, strict=True))
    )
    listed = listed if len(listed) > 1 else ()
    kinds: tuple[tuple[AskedKind, str, int | list[str]], ...]
    kinds = ("time", "T", stack.count("T")), ("channel", "C", channels[id(stack)])
    for kind, letter, names_or_count in kinds:
        at, alike = chosen(path, kind, names_or_count, choice, stack.dimensions, stack.dtype)
        index |= {k: at for k in stack.others if stack.axes[k] == letter}
        listed += alike
    return stack, index, listed


def _series(volumes: list[Stack]) -> tuple[list[str], list[tuple[Stack, dict[int, int]]]]:
    """List volumes apart from their time steps and channels, by name."""
    owners: list[tuple[Stack, dict[int, int]]] = []
    titles: list[str] = []
    for stack in volumes:
        apart = [k for k in stack.others if stack.axes[k] not in "TC"]
        for place in np.ndindex(*(int(stack.series.shape[k]) for k in apart)):
            owners.append((stack, dict(zip(apart, place, strict=True))))
            titles.append(stack.series.name or "")
    is_named = all(titles) and len(set(titles)) == len(titles)
    return (titles if is_named else [str(k) for k in range(len(owners))]), owners


def _without_data(stack: Stack, values: NDArray[np.generic]) -> NDArray[np.bool_] | None:
    """Find the voxels of the value that GDAL's tag declares to be no data."""
    try:
        value = float(str(stack.series.keyframe.tags.valueof(42113)).strip("\0 "))
    except ValueError:
        return None
    missing: NDArray[np.bool_] = values == value
    return missing if missing.ndim == 3 and missing.any() else None


def _kind_notes(tiff: TiffFile, stack: Stack) -> tuple[str, ...]:
    """Say what of the file is not shown as it may be meant, or is left out as it does not fit."""
    notes: tuple[str, ...] = ()
    text, kind = tiff.pages.first.description or "", stack.series.kind
    if "<OME" in text[:4096] and kind != "ome":
        notes += (
            "The file's OME header is damaged and left out: channels and times, if there are any, "
            "alternate among the slices.",
        )
    elif text.startswith("ImageJ=") and kind != "imagej":
        notes += ("ImageJ's description does not fit the file's images, which are read in order.",)
    photometric = int(stack.series.keyframe.photometric)
    if photometric == MINISWHITE:
        notes += ("In this file 0 is white; the values are shown as stored, not inverted.",)
    if photometric == PALETTE:
        notes += ("The colours of the file's look-up table are left out; its indices are read.",)
    if stack.depth is not None and stack.axes[stack.depth] in "TC":
        what = {"T": "time steps", "C": "channels"}[stack.axes[stack.depth]]
        notes += (f"The file calls its images {what}; they are taken for the slices of a volume.",)
    return notes


# --- the volumes of a file ----------------------------------------------------------------

GREATEST_RATIO = 1 << 14  # of pixels to their bytes in the file that is believed

UNCOMPRESSED = 1


@dataclass(frozen=True, eq=False)
class Stack:
    """A volume, or several of equal size, within a series of pages.

    `depth` is the series' axis that is z, None for a flat image; along the others there are several
    volumes: times, channels, positions.
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

    Tifffile takes the pages of a stack by ImageJ to lie one behind the other; programs that copy
    ImageJ's description put them elsewhere. Where all series are single images, those of the size
    that most have are one series.
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
    """Find which of a series' axes is z."""
    axes, shape = series.axes, series.shape
    inner = {axes.find(letter) for letter in "YXS"}
    outer = [k for k in range(len(axes)) if k not in inner and shape[k] > 1]
    unnamed, times, channels = (
        [k for k in reversed(outer) if axes[k] in letters]
        for letters in (set(axes) - {*"TC"}, "T", "C")
    )
    named = [k for k in outer if axes[k] == "Z"]
    depth = next(iter([*named, *unnamed, *times, *channels]), None)
    return Stack(series, depth, tuple(k for k in outer if k != depth))


def check_pages(path: Path, stack: Stack, flat: bool = False) -> None:
    """Check that its folder has the bytes of a stack's pixels; a flat one may be a single slice."""
    series = stack.series
    if np.dtype(series.dtype).kind not in "biuf":
        raise unsupported(
            path, f"a TIFF of {series.dtype} voxels", "save its magnitude, for example in Fiji"
        )
    if not flat:
        check_grid(path, stack.dimensions, stack.dtype, stack.samples)
    folder = path.parent.resolve()
    pages: list[Any] = list(series.pages)
    for page in pages:
        if page is None:
            raise damaged(path, "pages that it names are missing, perhaps in other files")
        place = Path(page.parent.filehandle.path).resolve()
        if not place.is_relative_to(folder):
            raise VolumeError(
                f"{path}: its pages lie outside its folder, in {place.name[:100]!r}, from which "
                "nothing is read; put the files together."
            )
    if series.dataoffset is not None:
        size = series.keyframe.parent.filehandle.size
        need = math.prod(series.shape) * np.dtype(series.dtype).itemsize
        check_present(path, size - series.dataoffset, need)
        return
    for page in pages:
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
    """Read one volume of a stack, by its number along each of the other axes, slice by slice."""
    nx, ny, nz = stack.dimensions
    values = np.empty((nz, ny, nx, stack.samples), stack.dtype)
    read = _plane_reader(stack.series)
    inner = "".join(letter for letter in stack.axes if letter in "YXS")
    order = [inner.index(letter) for letter in "YXS" if letter in inner]
    for target, z in zip(values, counted("slices read", range(nz)), strict=True):
        place = tuple(
            slice(None) if letter in "YXS" else z if k == stack.depth else index.get(k, 0)
            for k, letter in enumerate(stack.axes)
        )
        target[...] = np.transpose(read(place), order).reshape(target.shape)
    return values if stack.samples > 1 else values[..., 0]


def _plane_reader(series: Any) -> Callable[[tuple[Any, ...]], NDArray[Any]]:
    """Return what reads a plane of a series: by itself where each page is one, else by zarr."""
    outer = series.shape[: -len(series.keyframe.shape)]
    if (
        series.dataoffset is None
        and series.shape == (*outer, *series.keyframe.shape)
        and math.prod(outer) == len(series.pages)
        and not {*series.axes[len(outer) :]} - {*"YXS"}
    ):
        # Importing zarr takes longer than most files.
        return lambda place: series.pages[
            int(np.ravel_multi_index(place[: len(outer)], outer)) if outer else 0
        ].asarray(maxworkers=1)
    import zarr

    stored = zarr.open_array(series.aszarr(level=0, chunkmode="page", maxworkers=1), mode="r")
    return lambda place: np.asarray(stored[place])
