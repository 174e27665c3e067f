"""DICOM files and their images: tags by pydicom, position and meaning of the pixels."""

from __future__ import annotations

import io
import os
import zlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np

from model.volume_files.checks import damaged, errors_of, not_a, truncated, unsupported

if TYPE_CHECKING:
    from pydicom import Dataset

PREAMBLE = 128
IMPLICIT, EXPLICIT = "1.2.840.10008.1.2", "1.2.840.10008.1.2.1"
DEFLATED, BIG_ENDIAN = "1.2.840.10008.1.2.1.99", "1.2.840.10008.1.2.2"
UNDEFINED = 0xFFFFFFFF
PLAIN = (IMPLICIT, EXPLICIT, DEFLATED, BIG_ENDIAN)  # syntaxes without compression of frames
PIXEL_TAGS = {(0x7FE0, 0x0010): "iu", (0x7FE0, 0x0008): "f4", (0x7FE0, 0x0009): "f8"}
MOST_INFLATED = 1 << 30  # most bytes of an inflated file
_TEXTS = ("CS", "DS", "IS", "UI", "SH", "DA", "TM", "AE", "AS")  # kinds of plain text


@dataclass(frozen=True, eq=False)
class DicomFile:
    """Tags of a DICOM file up to the pixels, and the pixels' position in it.

    The kind is that of integers ("iu") or floating-point numbers; None without pixels. The length
    is -1 for encapsulated pixels. `content` is the whole file if it had to be inflated.
    """

    path: Path
    tags: Dataset
    syntax: str
    order: str
    kind: str | None
    offset: int = 0
    length: int = 0
    content: bytes | None = None

    def text(self, name: str) -> str:
        """Return a tag's value as text; empty if it is missing."""
        return text_of(self.tags, name)

    def meta_text(self, name: str) -> str:
        """Return a value of the file's meta information as text; empty if it is missing."""
        meta = getattr(self.tags, "file_meta", None)
        return "" if meta is None else text_of(meta, name)

    def open(self) -> BinaryIO:
        """Open the file's content for reading."""
        return self.path.open("rb") if self.content is None else io.BytesIO(self.content)


def text_of(tags: Dataset, name: str) -> str:
    """Return a tag's value as text; empty if it is missing or malformed."""
    tag = _tag(name)
    try:
        element: Any = tags.get_item(tag) if tag in tags else None
        if getattr(element, "is_raw", False) and element.VR in _TEXTS:
            # pydicom takes long to convert a text.
            return (element.value or b"").decode("latin-1").strip(" \0")
    except Exception:
        # pydicom converts values on access, and raises errors of many kinds.
        return ""
    value = value_of(tags, name)
    if value is None:
        return ""
    if isinstance(value, str | int | float):
        return str(value).strip(" \0")
    try:
        return "\\".join(str(each) for each in value)
    except TypeError:
        return str(value)


def value_of(tags: Dataset, name: str) -> Any:
    """Return a tag's value; None if it is missing, empty or malformed."""
    try:
        return tags[_tag(name)].value
    except Exception:
        # As above.
        return None


def numbers_of(tags: Dataset, name: str) -> list[float]:
    """Return a tag's decimal numbers; empty if it is missing or malformed."""
    text = text_of(tags, name)
    try:
        return [float(word) for word in text.split("\\")] if text else []
    except ValueError:
        return []


def number_in(tags: Dataset, name: str, default: float = 0.0) -> float:
    """Return the first of a tag's numbers."""
    return (numbers_of(tags, name) or [default])[0]


@cache
def _tag(name: str) -> int:
    from pydicom.datadict import tag_for_keyword

    tag = tag_for_keyword(name)
    assert tag is not None
    return tag


def is_dicom(path: Path, has_preamble: bool = False) -> bool:
    """Return True if a file begins like DICOM, with its preamble or, optionally, without."""
    with path.open("rb") as file:
        start = file.read(PREAMBLE + 4)
    return start[PREAMBLE:] == b"DICM" or (not has_preamble and _is_bare(start))


def is_foreign(path: Path) -> bool:
    """Whether a file is neither DICOM nor, as far as can be seen, the beginning of such a file."""
    if is_dicom(path):
        return False
    with path.open("rb") as file:
        start = file.read(PREAMBLE).lstrip(b"\0")
    return start[:1] not in (b"", b"\x02", b"\x08")


def _is_bare(start: bytes) -> bool:
    """Whether bytes begin with a tag of group 2 or 8 and its length, as without a preamble."""
    if len(start) < 12 or start[:2] not in (b"\x02\0", b"\x08\0") or start[3] != 0:
        return False
    if start[4:6] in (b"UL", b"UI", b"CS", b"LO", b"DA", b"SH", b"TM", b"OB"):
        return True
    return int.from_bytes(start[4:8], "little") <= PREAMBLE


def read_dicom_file(path: Path) -> DicomFile:
    """Read a DICOM file's tags."""
    from pydicom import config
    from pydicom.errors import InvalidDicomError

    # Many files break rules of values; needed ones are checked here.
    config.settings.reading_validation_mode = config.IGNORE
    if not is_dicom(path):
        raise not_a(path, "a DICOM file")
    says, cut_off = "its tags cannot be read: {}", (EOFError, InvalidDicomError)
    with errors_of(path, says, "pydicom", cut_off=cut_off, missing="a tag is cut off"):
        return _read(path)


def _read(path: Path) -> DicomFile:
    from pydicom import dcmread
    from pydicom.filereader import read_file_meta_info

    with path.open("rb") as file:
        start = file.read(2048)
        file.seek(0)
        if start[PREAMBLE : PREAMBLE + 4] == b"DICM" and DEFLATED.encode() in start:
            content = _inflated(path, read_file_meta_info(path))
            whole: BinaryIO = io.BytesIO(content)
            tags = dcmread(whole, stop_before_pixels=True, force=True)
            return _located(path, tags, EXPLICIT, whole, len(content), content)
        tags = dcmread(file, stop_before_pixels=True, force=True)
        syntax = text_of(getattr(tags, "file_meta", tags), "TransferSyntaxUID")
        if not syntax:
            syntax = IMPLICIT if tags.original_encoding[0] else EXPLICIT
            syntax = syntax if tags.original_encoding[1] is not False else BIG_ENDIAN
        return _located(path, tags, syntax, file, os.fstat(file.fileno()).st_size, None)


def _inflated(path: Path, meta: Any) -> bytes:
    """Return a deflated file as one in the explicit little-endian syntax."""
    with path.open("rb") as file:
        # The meta group's length is the value of its first element.
        file.seek(PREAMBLE + 4 + 12 + int(meta.FileMetaInformationGroupLength))
        decoder = zlib.decompressobj(-zlib.MAX_WBITS)
        try:
            data = decoder.decompress(file.read(), MOST_INFLATED)
        except zlib.error as error:
            raise damaged(path, f"its compressed stream is invalid ({error})") from None
    if decoder.unconsumed_tail:
        raise unsupported(path, "a deflated DICOM file of more than 1 GiB", "decompress it first")
    if not decoder.eof:
        raise truncated(path, "its compressed stream stops before the end")
    return data


def _located(
    path: Path, tags: Dataset, syntax: str, file: BinaryIO, size: int, content: bytes | None
) -> DicomFile:
    """Find the pixels, before which pydicom stopped."""
    order = ">" if syntax == BIG_ENDIAN else "<"
    byte_order: Literal["big", "little"] = "big" if order == ">" else "little"
    start = file.read(8)
    group, element = (int.from_bytes(start[k : k + 2], byte_order) for k in (0, 2))
    kind = PIXEL_TAGS.get((group, element))
    if kind is None or len(start) < 8:
        return DicomFile(path, tags, syntax, order, None, content=content)
    implicit = not start[4:6].isalpha() or syntax == IMPLICIT
    data = start[4:8] if implicit else file.read(4)
    if len(data) < 4:
        raise truncated(path, "a tag is cut off")
    length = int.from_bytes(data, byte_order)
    offset = file.tell()
    if length == UNDEFINED:
        length = -1
    elif offset + length > size:
        raise truncated(
            path, f"it has {size - offset} of the {length} bytes of pixels that it requires"
        )
    return DicomFile(path, tags, syntax, order, kind, offset, length, content)


# --- images -------------------------------------------------------------------------------

MOST_FRAMES = 100_000
NO_UNITS = ("", "US")
PET_UNITS = {"BQML": "Bq/ml", "CNTS": "counts", "GML": "g/ml", "PROPCNTS": "", "NONE": ""}

SPACINGS = "PixelSpacing", "NominalScannedPixelSpacing", "ImagerPixelSpacing"  # the best first

_NESTED = {
    "TemporalPositionIndex": "FrameContentSequence", "StackID": "FrameContentSequence",
    "NominalCardiacTriggerDelayTime": "CardiacSynchronizationSequence",
    "NominalPercentageOfCardiacPhase": "CardiacSynchronizationSequence",
    "EffectiveEchoTime": "MREchoSequence", "DiffusionBValue": "MRDiffusionSequence",
    "ComplexImageComponent": "MRImageFrameTypeSequence", "FrameType": "MRImageFrameTypeSequence",
    "ReferencedSegmentNumber": "SegmentIdentificationSequence",
}  # fmt: skip
"""Functional groups of multi-frame files, by field."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One image of a DICOM file; what is unknown is empty.

    The position is that of the first pixel's centre in mm in the patient's space (LPS), orientation
    and spacing are those of rows and columns. `thickness` is the distance of slices or else their
    thickness; `number` is the instance's.
    """

    file: DicomFile
    index: int
    groups: tuple[Dataset, ...]
    rows: int
    columns: int
    position: tuple[float, ...]
    orientation: tuple[float, ...]
    spacing: tuple[float, ...]
    thickness: float | None
    slope: float
    intercept: float
    is_rescaled: bool
    units: str
    number: float

    def field(self, name: str) -> str:
        """Return an identifying field as text, of the frame or else of the file."""
        nested = _NESTED.get(name)
        for group in self.groups:
            if nested and (found := _first_item(group, nested)) is not None:
                text = text_of(found, name)
                if name == "DiffusionGradientOrientation":
                    item = _first_item(found, "DiffusionGradientDirectionSequence")
                    text = "" if item is None else text_of(item, name)
                if text:
                    return text
        return self.file.text(name)

    @property
    def normal(self) -> tuple[float, float, float]:
        """Direction perpendicular to the image."""
        axes = self.orientation or (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
        x, y, z = np.cross(axes[:3], axes[3:])
        return float(x), float(y), float(z)


def frames_of(file: DicomFile) -> list[Frame]:
    """Return the images of a file; none if it has no pixels."""
    if file.kind is None:
        return []
    tags = file.tags
    count = int(number_in(tags, "NumberOfFrames")) or 1
    per_frame = value_of(tags, "PerFrameFunctionalGroupsSequence") or ()
    if not 1 <= count <= MOST_FRAMES or (len(per_frame) and len(per_frame) < count):
        raise damaged(file.path, f"it claims {count} frames")
    shared = _first_item(tags, "SharedFunctionalGroupsSequence")
    offsets = numbers_of(tags, "GridFrameOffsetVector")
    rows, columns = (int(number_in(tags, name)) for name in ("Rows", "Columns"))
    position = _placed(tags, "ImagePositionPatient")
    orientation = _placed(tags, "ImageOrientationPatient")
    spacing = next(filter(None, (numbers_of(tags, name) for name in SPACINGS)), [])
    number = number_in(tags, "InstanceNumber")
    frames = []
    for index in range(count):
        groups = tuple(g for g in (per_frame[index] if per_frame else None, shared) if g)
        measures = _measures(tags, groups)
        place = _grouped(groups, "PlanePositionSequence", "ImagePositionPatient") or position
        axes = _grouped(groups, "PlaneOrientationSequence", "ImageOrientationPatient")
        axes = axes or orientation
        if count > 1 and not per_frame and len(place) == 3 and len(axes) == 6:
            # In nuclear medicine they may be in the reverse order of their normal.
            is_down = file.text("Modality") == "NM" and number_in(tags, "SpacingBetweenSlices") < 0
            step = (measures or 1.0) * index * (-1 if is_down else 1)
            if len(offsets) == count:
                step = offsets[index] - offsets[0]
            normal = np.cross(axes[:3], axes[3:])
            place = (np.array(place) + step * normal).tolist()
        frames.append(
            Frame(
                file,
                index,
                groups,
                rows,
                columns,
                tuple(place) if _usable(place, 3) else (),
                tuple(axes) if _usable(axes, 6) else (),
                tuple(_grouped(groups, "PixelMeasuresSequence", "PixelSpacing") or spacing),
                measures,
                *_rescaling(file, groups),
                number + index if count > 1 else number,
            )
        )
    return frames


def _usable(values: list[float], count: int) -> bool:
    return len(values) == count and bool(np.isfinite(values).all())


def _placed(tags: Dataset, name: str) -> list[float]:
    """Return position or orientation of the first image; the detector's in nuclear medicine."""
    found = numbers_of(tags, name)
    if found:
        return found
    detector = _first_item(tags, "DetectorInformationSequence")
    return [] if detector is None else numbers_of(detector, name)


def _first_item(tags: Dataset, sequence: str) -> Dataset | None:
    items = value_of(tags, sequence)
    try:
        return items[0] if items else None
    except (TypeError, IndexError, KeyError):
        return None


def _grouped(groups: tuple[Dataset, ...], sequence: str, name: str) -> list[float]:
    """Return numbers of a functional group, of the frame's own or the shared one."""
    for group in groups:
        item = _first_item(group, sequence)
        if item is not None and (found := numbers_of(item, name)):
            return found
    return []


def _measures(tags: Dataset, groups: tuple[Dataset, ...]) -> float | None:
    """Return the distance of slices, or else their thickness."""
    for name in ("SpacingBetweenSlices", "SliceThickness"):
        found = _grouped(groups, "PixelMeasuresSequence", name) or numbers_of(tags, name)
        if found and np.isfinite(found[0]) and found[0] != 0:
            return abs(found[0])
    return None


def _rescaling(file: DicomFile, groups: tuple[Dataset, ...]) -> tuple[float, float, bool, str]:
    """Return slope, intercept, whether they are given, and the units of the values."""
    for tags in (*(_first_item(g, "PixelValueTransformationSequence") for g in groups), file.tags):
        if tags is None:
            continue
        slope, intercept = numbers_of(tags, "RescaleSlope"), numbers_of(tags, "RescaleIntercept")
        if not slope and not intercept:
            continue
        pair = (slope or [1.0])[0], (intercept or [0.0])[0]
        if pair[0] == 0 or not np.isfinite(pair).all():
            continue
        return *pair, True, _units(file, text_of(tags, "RescaleType"))
    scaling, units = number_in(file.tags, "DoseGridScaling"), file.text("DoseUnits")
    if np.isfinite(scaling) and scaling > 0:
        return scaling, 0.0, True, {"GY": "Gy"}.get(units, units.lower())
    return 1.0, 0.0, False, ""


def _units(file: DicomFile, kind: str) -> str:
    """Return the units of rescaled values: the given ones, or HU for a CT."""
    if kind not in NO_UNITS:
        return kind
    modality = file.text("Modality")
    if modality == "PT":
        units = file.text("Units")
        return PET_UNITS.get(units, units)
    is_plain = "LOCALIZER" not in file.text("ImageType").upper()
    return "HU" if modality == "CT" and kind == "" and is_plain else ""
