"""Voxel size, units and calibration that programs write into TIFF files."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from model.volume_files.checks import number_of
from model.volume_files.grid import in_one_unit

if TYPE_CHECKING:
    from tifffile import TiffFile

X_RESOLUTION, Y_RESOLUTION, RESOLUTION_UNIT, PIXEL_SCALE = 282, 283, 296, 33550
INCH, CENTIMETRE = 2, 3
SIGNED_16 = -32768.0
PRINTED = (72, 96, 100, 120, 150, 200, 240, 300, 360, 600, 1200)  # of pages in print

NO_UNITS = ("", "pixel", "pixels")


@dataclass(frozen=True)
class Scale:
    """Voxel size of a TIFF file along x, y and z; None for that of which the file says nothing."""

    spacing: tuple[float | None, float | None, float | None] | None = None
    unit: str = ""
    notes: tuple[str, ...] = ()


def voxel_scale(tiff: TiffFile, series_number: int) -> Scale:
    """Return the voxel size that ImageJ, OME, MetaSeries, Micro-Manager or others have written."""
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
            return Scale()
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
    sizes, unit, notes = in_one_unit([_size(length) for length in lengths], units)
    return Scale((sizes[0], sizes[1], sizes[2]), unit, notes)


def calibrated(tiff: TiffFile, values: NDArray[Any]) -> tuple[NDArray[Any], str, tuple[str, ...]]:
    """Apply ImageJ's calibration of the values; also return their units and notes.

    Signed 16-bit numbers, which ImageJ stores with an offset, become what they are; another
    straight line gives float32.
    """
    data = tiff.imagej_metadata or {}
    units = str(data.get("vunit", ""))
    units = "" if units.lower() in ("gray value", "grey value", "") else units
    offset, slope = number_of(data.get("c0")), number_of(data.get("c1"))
    if "cf" not in data or offset is None or slope is None:
        return values, units, ()
    if str(data["cf"]) not in ("0", "0.0") or number_of(data.get("c2")) is not None:
        return values, "", ("ImageJ's calibration curve of the values is not applied.",)
    if (offset, slope) == (0.0, 1.0) or slope == 0:
        return values, units, ()
    if (offset, slope) == (SIGNED_16, 1.0) and values.dtype == np.uint16:
        values ^= np.uint16(0x8000)
        return values.view(np.int16), units, ()
    wide = np.float64 if values.dtype.itemsize > 2 else np.float32
    scaled: NDArray[np.floating] = values.astype(wide)
    scaled *= slope
    scaled += offset
    return scaled, units, ()


def _size(value: Any) -> float | None:
    """Return a length as a number; None if it is none above zero."""
    number = number_of(value)
    return None if number is None or number <= 0 else number


def _resolution(tiff: TiffFile, tag: int) -> float | None:
    """Return the distance of pixels by a resolution tag."""
    value = tiff.pages.first.tags.valueof(tag)
    if isinstance(value, tuple) and len(value) == 2 and all(value):
        return _size(value[1] / value[0])
    return None


def _of_imagej(tiff: TiffFile, data: Mapping[str, Any]) -> Scale:
    """ImageJ leaves out what is 1: the distance of slices, and the resolution."""
    unit = str(data.get("unit", "")).strip()
    x, y = _resolution(tiff, X_RESOLUTION), _resolution(tiff, Y_RESOLUTION)
    z = number_of(data.get("spacing"))
    if x is None and y is None and z is None and unit.lower() in NO_UNITS:
        return Scale()
    units = [unit, str(data.get("yunit", unit)), str(data.get("zunit", unit))]
    lengths: list[float | None] = [x or 1.0, y or x or 1.0, abs(z) if z else 1.0]
    if (x, y) in ((None, None), (1.0, 1.0)) and z is None and unit.lower() in NO_UNITS:
        return Scale()
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
    """Return what an OME header says of the pixels of one of its images."""
    if "<!ENTITY" in text:
        return None
    try:
        root = ElementTree.fromstring(text.strip("\0 \n"))
    except (ElementTree.ParseError, ValueError):
        return None
    pixels = [element for element in root.iter() if _kind(element) == "Pixels"]
    return pixels[number] if number < len(pixels) else None


def _of_tags(tiff: TiffFile) -> Scale:
    """Scale of geographic files, else what a resolution says of x and y."""
    scale = tiff.pages.first.tags.valueof(PIXEL_SCALE)
    if isinstance(scale, tuple) and len(scale) == 3:
        x, y, z = (_size(each) for each in scale)
        return Scale((x, y, z)) if x and y else Scale()
    x, y = _resolution(tiff, X_RESOLUTION), _resolution(tiff, Y_RESOLUTION)
    unit = tiff.pages.first.tags.valueof(RESOLUTION_UNIT)
    kinds = {INCH: "inch", CENTIMETRE: "cm"}
    spacing = re.search(r"(?m)^spacing=([-+.\deE]+)", tiff.pages.first.description or "")
    z = _size(spacing.group(1)) if spacing else None
    if z is not None and x is not None:
        return Scale((x, y, z))
    if x is None or y is None or x == y == 1 or unit not in kinds:
        return Scale()
    if unit == INCH and x == y and round(1 / x, 6) in PRINTED:
        return Scale(
            notes=(
                f"The file's {1 / x:.5g} pixels per inch are meant for printing, and are ignored.",
            )
        )
    factor = {"inch": 25.4, "cm": 10.0}[kinds[unit]]
    return Scale((x * factor, y * factor, None), "mm")
