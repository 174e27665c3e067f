"""Reading of a DICOM file's tags up to its pixels."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from model.errors import VolumeError
from model.volume_files.checks import truncated, unsupported

Tag = tuple[int, int]

PREAMBLE = 128
TRANSFER_SYNTAX: Tag = (0x0002, 0x0010)
PIXEL_DATA: Tag = (0x7FE0, 0x0010)
_ITEM: Tag = (0xFFFE, 0xE000)
_ITEM_END: Tag = (0xFFFE, 0xE00D)
_SEQUENCE_END: Tag = (0xFFFE, 0xE0DD)
_UNDEFINED = 0xFFFFFFFF
_LONG_FORMS = {b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR"} | {
    b"UT",
    b"UV",
}
_LONGEST_VALUE = 1 << 16
_DEEPEST = 32

_IMPLICIT, _EXPLICIT, _BIG = "1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"


@dataclass(frozen=True)
class Tags:
    """Tags of a DICOM file, and the location of its pixels.

    Attributes
    ----------
    path : Path
    values : dict
        Raw value of each top-level tag that is not too long.
    order : {"<", ">"}
        Byte order of numbers and pixels.
    pixels : tuple of int or None
        Offset and length in bytes of the pixels; None if there are none.
    """

    path: Path
    values: dict[Tag, bytes]
    order: str
    pixels: tuple[int, int] | None

    def text(self, group: int, element: int) -> str:
        """Return a tag's text; empty if it is missing."""
        return self.values.get((group, element), b"").decode("latin-1").strip(" \0")

    def numbers(self, group: int, element: int) -> list[float]:
        """Return a tag's decimal numbers; empty if it is missing or malformed."""
        try:
            return [float(word) for word in self.text(group, element).split("\\")]
        except ValueError:
            return []

    def short(self, group: int, element: int, default: int) -> int:
        """Return a tag's unsigned 16-bit number."""
        value = self.values.get((group, element), b"")
        return int(struct.unpack(self.order + "H", value[:2])[0]) if len(value) >= 2 else default


def is_dicom(path: Path) -> bool:
    """Return True if a file has DICOM's preamble and prefix."""
    with path.open("rb") as file:
        return file.read(PREAMBLE + 4)[PREAMBLE:] == b"DICM"


def read_tags(path: Path) -> Tags:
    """Read the tags of a DICOM file with uncompressed pixels.

    Raises
    ------
    VolumeError
        When the file is cut off or its pixels are compressed.
    """
    with path.open("rb") as file:
        file.seek(PREAMBLE + 4)
        walk = _Walk(path, file)
        try:
            walk.elements()
        except struct.error:
            raise truncated(path, "a tag is cut off") from None
        return Tags(path, walk.values, walk.order, walk.pixels)


class _Walk:
    """Parser of the elements of an open file."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self.path, self.file = path, file
        self.size = path.stat().st_size
        self.values: dict[Tag, bytes] = {}
        self.pixels: tuple[int, int] | None = None
        self.order, self.explicit, self.in_meta = "<", True, True

    def elements(self) -> None:
        """Collect the top-level elements up to the pixels or the file's end."""
        while self.pixels is None and self.file.tell() < self.size:
            if self.in_meta:
                self._leave_meta()
            tag, length = self._element()
            if tag == PIXEL_DATA:
                if length == _UNDEFINED:
                    raise self._compressed()
                self.pixels = self.file.tell(), length
            elif length == _UNDEFINED:
                self._skip_sequence(0)
            else:
                self._keep(tag, length)

    def _leave_meta(self) -> None:
        """Switch to the data set's encoding at the end of the file's meta information."""
        place = self.file.tell()
        group = self._unpack("<H")[0]
        self.file.seek(place)
        if group == 0x0002:
            return
        self.in_meta = False
        syntax = self.values.get(TRANSFER_SYNTAX, b"").decode("latin-1").strip(" \0")
        if syntax not in (_IMPLICIT, _EXPLICIT, _BIG):
            raise self._compressed()
        self.explicit = syntax != _IMPLICIT
        self.order = ">" if syntax == _BIG else "<"

    def _unpack(self, form: str) -> tuple[int, ...]:
        return struct.unpack(form, self.file.read(struct.calcsize(form)))

    def _element(self) -> tuple[Tag, int]:
        """Read the tag and length of the next element."""
        group, element = self._unpack(self.order + "HH")
        if not self.explicit or group == 0xFFFE:
            return (group, element), self._unpack(self.order + "I")[0]
        if self.file.read(2) in _LONG_FORMS:
            return (group, element), self._unpack(self.order + "2xI")[0]
        return (group, element), self._unpack(self.order + "H")[0]

    def _keep(self, tag: Tag, length: int) -> None:
        if self.file.tell() + length > self.size:
            raise truncated(self.path, "a tag is cut off")
        if length <= _LONGEST_VALUE:
            self.values[tag] = self.file.read(length)
        else:
            self.file.seek(length, 1)

    def _skip_sequence(self, depth: int) -> None:
        """Skip the items of a sequence of undefined length."""
        while True:
            tag, length = self._element()
            if tag == _SEQUENCE_END:
                return
            if tag == _ITEM and length == _UNDEFINED:
                self._skip_item(depth)
            else:
                self.file.seek(length, 1)

    def _skip_item(self, depth: int) -> None:
        if depth > _DEEPEST:
            raise truncated(self.path, "its sequences never end")
        while True:
            tag, length = self._element()
            if tag == _ITEM_END:
                return
            if length == _UNDEFINED:
                self._skip_sequence(depth + 1)
            else:
                self.file.seek(length, 1)

    def _compressed(self) -> VolumeError:
        return unsupported(
            self.path,
            "a DICOM file with compressed pixels",
            "decompress the series first, for example with gdcmconv --raw",
        )
