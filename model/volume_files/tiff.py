"""TIFF files of one or more volumes, read by tifffile."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError, first_line
from model.scene.file_facts import Content, FileFacts
from model.volume_files.checks import check_grid, damaged, times, truncated
from model.volume_files.choice import (
    LARGEST,
    AskedKind,
    Choice,
    choice_notes,
    chosen,
    chosen_index,
    content,
)
from model.volume_files.frame import usable_spacing
from model.volume_files.grid import Grid
from model.volume_files.library_log import log_of
from model.volume_files.tiff_scale import calibrated, channel_names, voxel_scale
from model.volume_files.tiff_stack import Stack, all_series, check_pages, read_stack, stack_of

if TYPE_CHECKING:
    from tifffile import TiffFile

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
                raise VolumeError(
                    f"{path}: this is not a TIFF file; choose another or correct its suffix."
                ) from None
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
        for stack in stacks:
            _check_own(path, stack)
        volumes = [stack for stack in stacks if stack.is_volume]
        if not volumes:
            raise _flat(path, stacks)
        names = [channel_names(tiff, number, s.count("C")) for number, s in enumerate(stacks)]
        channels = dict(zip(map(id, stacks), names, strict=True))
        stack, index, listed = _chosen(path, volumes, choice, channels)
        check_pages(path, stack)
        values = read_stack(path, stack, index)
        missing, missing_notes = _without_data(stack, values)
        values, units, notes = calibrated(tiff, values)
        scale = voxel_scale(tiff, stacks.index(stack))
        spacing, spacing_notes = usable_spacing(scale.spacing)
        notes += _kind_notes(stack) + _header_notes(tiff, stack)
        if len(volumes) < len(stacks):
            notes += (f"Flat images were left out: {len(stacks) - len(volumes)}.",)
        return Grid(
            values,
            spacing,
            units=units,
            notes=choice_notes(listed) + notes + missing_notes + scale.notes + spacing_notes,
            missing=missing,
            facts=FileFacts(_NAMES.get(stack.series.kind, "TIFF"), scale.unit, contents=listed),
        )


def _check_own(path: Path, stack: Stack) -> None:
    """Refuse pages in other files than those of the folder, which a stranger's header may name."""
    folder = path.parent.resolve()
    for page in stack.series.pages:
        if page is None:
            raise damaged(path, "pages that it names are missing, perhaps in files beside it")
        place = Path(page.parent.filehandle.path).resolve()
        if not place.is_relative_to(folder):
            raise VolumeError(
                f"{path}: its pages lie outside its folder, in {place.name[:100]!r}, from which "
                "nothing is read; put the files together."
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
        beside = sum(1 for other in path.parent.glob(f"*{path.suffix}") if other.name[0] != ".")
        if beside > 2:
            return VolumeError(
                f"{path}: this is a flat image of {times(stacks[0].dimensions)} pixels, not a "
                f"volume; if it is one of the {beside} slices in its folder, open the folder."
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


def _without_data(
    stack: Stack, values: NDArray[np.generic]
) -> tuple[NDArray[np.bool_] | None, tuple[str, ...]]:
    """Find the voxels of the value that GDAL's tag declares to be no data."""
    tag = stack.series.keyframe.tags.valueof(42113)
    try:
        value = float(str(tag).strip("\0 "))
    except ValueError:
        return None, ()
    missing: NDArray[np.bool_] = values == value
    return (missing, ()) if missing.ndim == 3 and missing.any() else (None, ())


def _header_notes(tiff: TiffFile, stack: Stack) -> tuple[str, ...]:
    """Say that a program's description is left out as it cannot be read, or does not fit."""
    text, kind = tiff.pages.first.description or "", stack.series.kind
    if "<OME" in text[:4096] and kind != "ome":
        return (
            "The file's OME header is damaged and left out: channels and times, if there are any, "
            "alternate among the slices.",
        )
    if text.startswith("ImageJ=") and kind != "imagej":
        return ("ImageJ's description does not fit the file's images, which are read in order.",)
    return ()


def _kind_notes(stack: Stack) -> tuple[str, ...]:
    """Say what of the file is not shown as it may be meant."""
    notes: tuple[str, ...] = ()
    photometric = int(stack.series.keyframe.photometric)
    if photometric == MINISWHITE:
        notes += ("In this file 0 is white; the values are shown as stored, not inverted.",)
    if photometric == PALETTE:
        notes += ("The colours of the file's look-up table are left out; its indices are read.",)
    if stack.depth is not None and stack.axes[stack.depth] in "TC":
        what = {"T": "time steps", "C": "channels"}[stack.axes[stack.depth]]
        notes += (f"The file calls its images {what}; they are taken for the slices of a volume.",)
    return notes
