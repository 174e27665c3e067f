"""One DICOM file: its tags by pydicom, and where its pixels lie."""

from __future__ import annotations

import io
import os
import zlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from model.errors import VolumeError, first_line
from model.volume_files.checks import damaged, truncated, unsupported
from model.volume_files.library_log import log_of

if TYPE_CHECKING:
    from pydicom import Dataset

PREAMBLE = 128
IMPLICIT, EXPLICIT = "1.2.840.10008.1.2", "1.2.840.10008.1.2.1"
DEFLATED, BIG_ENDIAN = "1.2.840.10008.1.2.1.99", "1.2.840.10008.1.2.2"
UNDEFINED = 0xFFFFFFFF
PIXEL_TAGS = {(0x7FE0, 0x0010): "iu", (0x7FE0, 0x0008): "f4", (0x7FE0, 0x0009): "f8"}
MOST_INFLATED = 1 << 30
"""Bytes that a deflated file may become."""

_TEXTS = ("CS", "DS", "IS", "UI", "SH", "DA", "TM", "AE", "AS")
"""Kinds of values that are plain text in a file."""


@dataclass(frozen=True, eq=False)
class DicomFile:
    """Tags of a DICOM file, and the place of its pixels.

    Attributes
    ----------
    tags : pydicom.Dataset
        Up to the pixels.
    syntax : str
        UID of the transfer syntax.
    order : {"<", ">"}
        Byte order of the pixels.
    kind : {"iu", "f4", "f8"} or None
        Integers or floating-point numbers; None without pixels.
    offset, length : int
        First byte and number of bytes of the pixels; the length is -1 where they are
        encapsulated, which compressed ones are.
    content : bytes or None
        The file's content where it had to be inflated as a whole.
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
    raw = _raw_text(tags, name)
    if raw is not None:
        return raw
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
    tag = _tag(name)
    if tag not in tags:
        return None
    try:
        return tags[tag].value
    except Exception:
        # pydicom converts values when they are asked for, and raises errors of many kinds.
        return None


def numbers_of(tags: Dataset, name: str) -> list[float]:
    """Return a tag's decimal numbers; empty if it is missing or malformed."""
    raw = _raw_text(tags, name)
    if raw is not None:
        try:
            return [float(word) for word in raw.split("\\")] if raw else []
        except ValueError:
            return []
    value = value_of(tags, name)
    if value is None or value == "":
        return []
    try:
        if isinstance(value, str | int | float):
            return [float(value)]
        return [float(number) for number in value]
    except (TypeError, ValueError, OverflowError):
        return []


@cache
def _tag(name: str) -> int:
    from pydicom.datadict import tag_for_keyword

    tag = tag_for_keyword(name)
    assert tag is not None
    return tag


def _raw_text(tags: Dataset, name: str) -> str | None:
    """Return a text that pydicom has not converted yet, which takes it long; else None."""
    tag = _tag(name)
    if tag not in tags:
        return ""
    try:
        element: Any = tags.get_item(tag)
    except Exception:
        # As for other values.
        return None
    if getattr(element, "is_raw", False) and element.VR in _TEXTS:
        return "" if element.value is None else element.value.decode("latin-1").strip(" \0")
    return None


def is_dicom(path: Path) -> bool:
    """Return True if a file begins as DICOM does, with its preamble or without."""
    with path.open("rb") as file:
        start = file.read(PREAMBLE + 4)
    return start[PREAMBLE:] == b"DICM" or _is_bare(start)


def has_preamble(path: Path) -> bool:
    """Return True if a file has DICOM's mark behind a preamble, whatever its suffix is."""
    with path.open("rb") as file:
        return file.read(PREAMBLE + 4)[PREAMBLE:] == b"DICM"


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

    # Many files break rules of values; what is needed of them is checked here.
    config.settings.reading_validation_mode = config.IGNORE
    if not is_dicom(path):
        raise VolumeError(f"{path}: this is not a DICOM file; remove it from the folder.")
    with log_of("pydicom"), path.open("rb") as file:
        try:
            return _read(path, file)
        except (OSError, MemoryError, VolumeError):
            raise
        except (EOFError, InvalidDicomError):
            raise truncated(path, "a tag is cut off") from None
        except Exception as error:
            raise damaged(path, f"its tags cannot be read: {first_line(error)}") from None


def _read(path: Path, file: BinaryIO) -> DicomFile:
    from pydicom import dcmread
    from pydicom.filereader import read_file_meta_info

    file.seek(PREAMBLE)
    has_preamble = file.read(4) == b"DICM"
    file.seek(0)
    if has_preamble and _is_deflated(file):
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


def _is_deflated(file: BinaryIO) -> bool:
    start = file.read(2048)
    file.seek(0)
    return DEFLATED.encode() in start


def _inflated(path: Path, meta: Any) -> bytes:
    """Return a deflated file as one in the explicit little-endian syntax."""
    with path.open("rb") as file:
        file.seek(PREAMBLE + 4)
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
    byte_order = "big" if order == ">" else "little"
    start = file.read(8)
    tag = tuple(int.from_bytes(start[k : k + 2], byte_order) for k in (0, 2))  # type: ignore[arg-type]
    kind = PIXEL_TAGS.get(tag)  # type: ignore[arg-type]
    if kind is None or len(start) < 8:
        return DicomFile(path, tags, syntax, order, None, content=content)
    implicit = not start[4:6].isalpha() or syntax == IMPLICIT
    data = start[4:8] if implicit else file.read(4)
    if len(data) < 4:
        raise truncated(path, "a tag is cut off")
    length = int.from_bytes(data, byte_order)  # type: ignore[arg-type]
    offset = file.tell()
    if length == UNDEFINED:
        length = -1
    elif offset + length > size:
        raise truncated(
            path, f"it has {size - offset} of the {length} bytes of pixels that it promises"
        )
    return DicomFile(path, tags, syntax, order, kind, offset, length, content)
