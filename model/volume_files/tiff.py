"""TIFF files of one or more volumes, by tifffile: series, voxel sizes, units, calibration."""

from __future__ import annotations

import math
import re
import struct
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError, first_line
from model.volume_files import checks
from model.volume_files.arrays import StoredArray, grid_of_arrays, rescaled
from model.volume_files.blocks import counted
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.grid import Grid, in_one_unit

if TYPE_CHECKING:
    from tifffile import TiffFile, TiffPageSeries

SUFFIXES = (".tif", ".tiff", ".stk", ".lsm")
MINISWHITE, PALETTE = 0, 3
GDAL_NODATA = 42113

_HARMLESS = re.compile(r"metadata> raised|subfiletype|GDAL_NODATA|OME series failed to read \d")
"""Warnings of tifffile that do not concern the pixels."""

_HARMLESS_OF_PAGES = re.compile(_HARMLESS.pattern + r"|ImageJ series metadata invalid")
"""Such warnings for a file of several pages."""

_BROKEN_CHAIN = re.compile(r"invalid (page offset|offset to page)")
"""Messages of tifffile for a file that ends before its last page."""

_NAMES = {"ome": "OME-TIFF", "imagej": "TIFF by ImageJ", "stk": "MetaSeries STK", "lsm": "LSM"}


@contextmanager
def opened_tiff(path: Path) -> Iterator[TiffFile]:
    """Open a TIFF file; tifffile's errors and warnings count as damage."""
    import tifffile

    says, cut = "its pixels cannot be unpacked: {}", "the header of a page lies beyond its end"
    # Decoders raise errors of many kinds.
    with (
        checks.log_of("tifffile") as warnings,
        checks.errors_of(path, says, cut_off=(struct.error,), missing=cut),
    ):
        try:
            with tifffile.TiffFile(path) as tiff:
                if not len(tiff.pages):
                    raise checks.damaged(path, "it has no pages")
                yield tiff
                # A stack after a single page was truncated; others were only described wrongly.
                is_described = len(tiff.pages) == 1
        except VolumeError:
            if any(_BROKEN_CHAIN.search(warning) for warning in warnings):
                # Defects of the remaining pages are only a consequence.
                raise checks.truncated(path, "its list of pages leads beyond its end") from None
            raise
        except tifffile.TiffFileError as error:
            if "not a TIFF" in str(error):
                raise checks.not_a(path, "a TIFF file") from None
            raise checks.damaged(path, first_line(error)) from None
    harmless = _HARMLESS if is_described else _HARMLESS_OF_PAGES
    if serious := [warning for warning in warnings if not harmless.search(warning)]:
        said = re.sub(r"^<tifffile\.\w+ [^>]*> ", "", serious[0])
        raise checks.damaged(path, f"tifffile says '{said.rstrip('.')}'")


def read_tiff(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a file's chosen volume, or the largest."""
    with opened_tiff(path) as tiff:
        series = all_series(tiff)
        stacks = [stored(path, tiff, number, each) for number, each in enumerate(series)]
        volumes = [stack for stack in stacks if min(dimensions_of(stack[0])) > 1]
        if not volumes:
            raise _flat(path, [stack[0] for stack in stacks])
        arrays = [array for stack in volumes for array in stack]
        if len({array.name for array in arrays} - {""}) < len(arrays):
            arrays = [replace(array, name=str(number)) for number, array in enumerate(arrays)]
        form = _NAMES.get(series[0].kind, "TIFF")
        grid = grid_of_arrays(path, arrays, choice, form, "series")
        values, units, notes = calibrated(tiff, grid.values)
        notes += grid.notes
        if len(volumes) < len(stacks):
            notes += (f"Flat images were left out: {len(stacks) - len(volumes)}.",)
        return replace(grid, values=values, units=units, notes=notes)


def _flat(path: Path, images: list[StoredArray]) -> VolumeError:
    """Return the error for a file without a volume."""
    sizes = list(dict.fromkeys(checks.times(dimensions_of(image)[:2]) for image in images))
    if len(images) > 1:
        types = ", ".join(dict.fromkeys(str(image.dtype) for image in images))
        return VolumeError(
            f"{path}: its slices differ in size, type or storage ({', '.join(sizes[:4])} of "
            f"{types}); keep those of one volume together."
        )
    slices = sum(1 for other in path.parent.glob(f"*{path.suffix}") if other.name[0] != ".")
    if slices <= 2:
        # Which says what is wrong.
        checks.check_grid(path, dimensions_of(images[0]), images[0].dtype)
    return VolumeError(
        f"{path}: this is a flat image of {checks.times(dimensions_of(images[0]))} pixels, not a "
        f"volume; if it is one of the {slices} slices in its folder, open the folder."
    )


def _kind_notes(tiff: TiffFile, series: TiffPageSeries, depth: str) -> tuple[str, ...]:
    """Describe parts of the file that may be shown differently than meant, or are left out."""
    notes: tuple[str, ...] = ()
    text, kind = tiff.pages.first.description or "", series.kind
    if "<OME" in text[:4096] and kind != "ome":
        notes += (
            "The file's OME header is damaged and left out: channels and times, if there are any, "
            "alternate among the slices.",
        )
    elif text.startswith("ImageJ=") and kind != "imagej":
        notes += ("ImageJ's description does not fit the file's images, which are read in order.",)
    photometric = int(series.keyframe.photometric)
    if photometric == MINISWHITE:
        notes += ("In this file 0 is white; the values are shown as stored, not inverted.",)
    if photometric == PALETTE:
        notes += ("The colours of the file's look-up table are left out; its indices are read.",)
    if depth in ("T", "C"):
        what = {"T": "time steps", "C": "channels"}[depth]
        notes += (f"The file calls its images {what}; they are taken for the slices of a volume.",)
    return notes


# --- the volumes of a file ----------------------------------------------------------------

GREATEST_RATIO = 1 << 14  # largest plausible ratio of pixels to their bytes in the file

UNCOMPRESSED = 1


def all_series(tiff: TiffFile) -> list[TiffPageSeries]:
    """Return tifffile's series, but those by ImageJ with the pages that the file lists.

    Tifffile expects those pages in sequence; programs that copy ImageJ's description put them
    elsewhere. Single images of one size are one series.
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


def stored(path: Path, tiff: TiffFile, number: int, series: TiffPageSeries) -> list[StoredArray]:
    """Return the volumes of a series, or its flat images; times and channels are axes of each."""
    axes, shape = series.axes, series.shape
    outer = [k for k in range(len(axes)) if axes[k] not in "YXS" and shape[k] > 1]
    # Along z, else along what is neither time nor channel.
    ranks = {"C": 0, "T": 1, "Z": 3}
    depth = max(outer, key=lambda k: (ranks.get(axes[k], 2), k), default=None)
    kept = [k for k in outer if k != depth and axes[k] in "TC"]
    channels = math.prod(shape[k] for k in kept if axes[k] == "C")
    kept += [k for k in outer if k == depth] + [axes.index(k) for k in "YXS" if k in axes]
    apart = [k for k in outer if k not in kept]
    names = {k: {"S": "components"}.get(axes[k], axes[k].lower()) for k in kept}
    if depth is not None:
        names[depth] = "z"
    dtype: np.dtype[Any] = np.dtype(series.dtype).newbyteorder("=")
    dtype = np.dtype({"?": "u1", "e": "f4"}.get(dtype.char, dtype))
    spacing, unit, notes = voxel_scale(tiff, number)
    notes = _kind_notes(tiff, series, "" if depth is None else axes[depth]) + notes
    return [
        StoredArray(
            series.name or "",
            tuple(int(shape[k]) for k in kept),
            dtype,
            partial(_read, path, series, dict(zip(apart, place, strict=True)), kept, dtype),
            tuple(names.values()),
            spacing=spacing,
            unit=unit,
            notes=notes,
            channels=tuple(channel_names(tiff, number, channels)),
        )
        for place in np.ndindex(*(int(shape[k]) for k in apart))
    ]


def dimensions_of(array: StoredArray) -> tuple[int, int, int]:
    """Return the voxels of a volume or image along x, y and z."""
    x, y, z = (array.shape[array.axes.index(k)] if k in array.axes else 1 for k in "xyz")
    return x, y, z


def _read(
    path: Path,
    series: Any,
    apart: dict[int, int],
    kept: list[int],
    dtype: np.dtype[Any],
    index: Sequence[int | slice],
) -> NDArray[Any]:
    """Read a volume slice by slice, or an image; GDAL's no-data values are masked."""
    _check_pages(path, series)
    place = {k: slice(None) if letter in "YXS" else 0 for k, letter in enumerate(series.axes)}
    place |= {**apart, **dict(zip(kept, index, strict=True))}
    whole = [k for k in kept if isinstance(place[k], slice)]
    values: NDArray[Any] = np.empty([series.shape[k] for k in whole], dtype)
    depth = whole[0] if series.axes[whole[0]] not in "YXS" else None
    inner = sorted(whole if depth is None else whole[1:])
    order = [inner.index(k) for k in whole if k != depth]
    read = _plane_reader(series)
    if depth is None:
        values[...] = np.transpose(read(tuple(place.values())), order)
        return values
    for z in counted("slices read", range(len(values))):
        values[z] = np.transpose(read(tuple((place | {depth: z}).values())), order)
    nodata = checks.number_of(str(series.keyframe.tags.valueof(GDAL_NODATA)).strip("\0 "))
    missing = values == nodata
    return np.ma.array(values, mask=missing) if values.ndim == 3 and missing.any() else values


def _check_pages(path: Path, series: Any) -> None:
    """Check that the folder has the bytes of a series' pixels."""
    if np.dtype(series.dtype).kind not in "biuf":
        raise checks.unsupported(
            path, f"a TIFF of {series.dtype} voxels", "save its magnitude, for example in Fiji"
        )
    folder = path.parent.resolve()
    pages: list[Any] = list(series.pages)
    for page in pages:
        if page is None:
            raise checks.damaged(path, "pages that it names are missing, perhaps in other files")
        place = Path(page.parent.filehandle.path).resolve()
        if not place.is_relative_to(folder):
            raise VolumeError(
                f"{path}: its pages lie outside its folder, in {place.name[:100]!r}, from which "
                "nothing is read; put the files together."
            )
    if series.dataoffset is not None:
        size = series.keyframe.parent.filehandle.size
        need = math.prod(series.shape) * np.dtype(series.dtype).itemsize
        checks.check_present(path, size - series.dataoffset, need)
        return
    for page in pages:
        size = page.parent.filehandle.size
        offsets, lengths = page.dataoffsets, page.databytecounts
        if len(offsets) != len(lengths) or not all(
            offset > 0 and length > 0 for offset, length in zip(offsets, lengths, strict=True)
        ):
            raise checks.damaged(path, "a page's strips do not add up")
        if any(o + n > size for o, n in zip(offsets, lengths, strict=True)):
            raise checks.truncated(path, "a page's pixels lie beyond its end")
        keyframe: Any = page.keyframe
        is_plain = keyframe.compression == UNCOMPRESSED
        need = keyframe.size * keyframe.bitspersample // 8
        if sum(lengths) * (1 if is_plain else GREATEST_RATIO) < need:
            raise checks.damaged(path, "a page has fewer pixels than its size says")


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


# --- what programs write beside the pixels ------------------------------------------------

X_RESOLUTION, Y_RESOLUTION, RESOLUTION_UNIT, PIXEL_SCALE = 282, 283, 296, 33550
INCH, CENTIMETRE = 2, 3
SIGNED_16 = -32768.0
PRINTED = (72, 96, 100, 120, 150, 200, 240, 300, 360, 600, 1200)  # in pages of print

NO_UNITS = ("", "pixel", "pixels")

Scale = tuple[Sequence[float | None] | None, str, tuple[str, ...]]
"""Voxel size along x, y and z, None if unknown, its unit, and notes."""

NOTHING: Scale = (None, "", ())


def voxel_scale(tiff: TiffFile, series_number: int) -> Scale:
    """Return the voxel size by ImageJ, OME, MetaSeries, Micro-Manager or others."""
    unit = "um"
    if tiff.is_ome and tiff.ome_metadata:
        pixels = _pixels(tiff.ome_metadata, series_number)
        data = {} if pixels is None else pixels.attrib
        units = [data.get(f"PhysicalSize{axis}Unit", unit) for axis in "XYZ"]
        return _scale([data.get(f"PhysicalSize{axis}") for axis in "XYZ"], units)
    if tiff.imagej_metadata is not None:
        return _of_imagej(tiff, tiff.imagej_metadata)
    lengths: list[Any]
    if tiff.is_lsm:
        data = tiff.lsm_metadata or {}
        metres = [_size(data.get(f"VoxelSize{axis}")) for axis in "XYZ"]
        lengths = [None if length is None else length * 1e6 for length in metres]
    elif tiff.is_stk:
        data = tiff.stk_metadata or {}
        distances = [*np.ravel(data.get("ZDistance", [])), None]
        lengths = [data.get("XCalibration"), data.get("YCalibration"), distances[0]]
        unit = str(data.get("CalibrationUnits", ""))
    elif tiff.is_metaseries:
        data = (tiff.metaseries_metadata or {}).get("PlaneInfo", {})
        if not data.get("spatial-calibration-state", True):
            return NOTHING
        lengths = [data.get(f"spatial-calibration-{axis}") for axis in "xy"]
        lengths.append(data.get("z-step", data.get("_MagSetting_z")))
        unit = str(data.get("spatial-calibration-units", ""))
    elif tiff.is_micromanager:
        data = (tiff.micromanager_metadata or {}).get("Summary", {})
        x = _size(data.get("PixelSize_um", data.get("PixelSizeUm")))
        y = None if x is None else x * (_size(data.get("PixelAspect")) or 1.0)
        lengths = [x, y, data.get("z-step_um", data.get("ZStepUm"))]
    else:
        return _of_tags(tiff)
    return _scale(lengths, [unit] * 3)


def _scale(lengths: Sequence[Any], units: Sequence[str]) -> Scale:
    return in_one_unit([_size(length) for length in lengths], units)


def calibrated(tiff: TiffFile, values: NDArray[Any]) -> tuple[NDArray[Any], str, tuple[str, ...]]:
    """Apply ImageJ's calibration of the values; also return their units and notes.

    Signed 16-bit numbers are stored with an offset; other linear maps give floats.
    """
    data = tiff.imagej_metadata or {}
    units = str(data.get("vunit", ""))
    units = "" if units.lower() in ("gray value", "grey value", "") else units
    offset, slope = checks.number_of(data.get("c0")), checks.number_of(data.get("c1"))
    if "cf" not in data or offset is None or slope is None:
        return values, units, ()
    if str(data["cf"]) not in ("0", "0.0") or checks.number_of(data.get("c2")) is not None:
        return values, "", ("ImageJ's calibration curve of the values is not applied.",)
    if (offset, slope) == (SIGNED_16, 1.0) and values.dtype == np.uint16:
        values ^= np.uint16(0x8000)
        return values.view(np.int16), units, ()
    return rescaled(values, slope, offset) if slope else values, units, ()


def _size(value: Any) -> float | None:
    """Return a length as a number above zero, or None."""
    number = checks.number_of(value)
    return None if number is None or number <= 0 else number


def _resolution(tiff: TiffFile, tag: int) -> float | None:
    """Return the pixel distance by a resolution tag."""
    value = tiff.pages.first.tags.valueof(tag)
    if isinstance(value, tuple) and len(value) == 2 and all(value):
        return _size(value[1] / value[0])
    return None


def _of_imagej(tiff: TiffFile, data: Mapping[str, Any]) -> Scale:
    """ImageJ omits the distance of slices and the resolution if they are 1."""
    unit = str(data.get("unit", "")).strip()
    x, y = _resolution(tiff, X_RESOLUTION), _resolution(tiff, Y_RESOLUTION)
    z = checks.number_of(data.get("spacing"))
    units = [unit, str(data.get("yunit", unit)), str(data.get("zunit", unit))]
    lengths: list[float | None] = [x or 1.0, y or x or 1.0, abs(z) if z else 1.0]
    if (x, y) in ((None, None), (1.0, 1.0)) and z is None and unit.lower() in NO_UNITS:
        return NOTHING
    return _scale(lengths, ["" if u.lower() in NO_UNITS else u for u in units])


def channel_names(tiff: TiffFile, series_number: int, count: int) -> list[str]:
    """Return the names of an image's channels by OME or Micro-Manager, else their numbers."""
    names: list[str] = []
    if tiff.is_ome and tiff.ome_metadata:
        pixels = _pixels(tiff.ome_metadata, series_number)
        channels = [] if pixels is None else [e for e in pixels if _kind(e) == "Channel"]
        names = [channel.get("Name", "").strip() for channel in channels]
    elif tiff.is_micromanager:
        found = (tiff.micromanager_metadata or {}).get("Summary", {}).get("ChNames")
        names = [str(name).strip() for name in found] if isinstance(found, list) else []
    is_named = len(names) == count and all(names) and len(set(names)) == count
    return names if is_named else [str(number) for number in range(count)]


def _kind(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _pixels(text: str, number: int) -> ElementTree.Element | None:
    """Return an OME header's description of one image's pixels."""
    if "<!ENTITY" in text:
        return None
    try:
        root = ElementTree.fromstring(text.strip("\0 \n"))
    except (ElementTree.ParseError, ValueError):
        return None
    pixels = [element for element in root.iter() if _kind(element) == "Pixels"]
    return pixels[number] if number < len(pixels) else None


def _of_tags(tiff: TiffFile) -> Scale:
    """Scale of geographic files, else x and y by the resolution."""
    scale = tiff.pages.first.tags.valueof(PIXEL_SCALE)
    if isinstance(scale, tuple) and len(scale) == 3:
        x, y, z = (_size(each) for each in scale)
        return ((x, y, z), "", ()) if x and y else NOTHING
    x, y = _resolution(tiff, X_RESOLUTION), _resolution(tiff, Y_RESOLUTION)
    unit = tiff.pages.first.tags.valueof(RESOLUTION_UNIT)
    lengths = {INCH: 25.4, CENTIMETRE: 10.0}
    spacing = re.search(r"(?m)^spacing=([-+.\deE]+)", tiff.pages.first.description or "")
    z = _size(spacing.group(1)) if spacing else None
    if z is not None and x is not None:
        return (x, y, z), "", ()
    if x is None or y is None or x == y == 1 or unit not in lengths:
        return NOTHING
    if unit == INCH and x == y and round(1 / x, 6) in PRINTED:
        dots = f"The file's {1 / x:.5g} pixels per inch are meant for printing, and are ignored."
        return None, "", (dots,)
    return (x * lengths[unit], y * lengths[unit], None), "mm", ()
