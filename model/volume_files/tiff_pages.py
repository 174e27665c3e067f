"""The pages of a TIFF file, from their directories, checked against the file's size.

Libraries drop pages after a damaged directory, and fill in pixels that are missing;
the directories are therefore checked first.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from model.errors import VolumeError
from model.volume_files.checks import damaged, truncated

WIDTH, HEIGHT, BITS, COMPRESSION, DESCRIPTION = 256, 257, 258, 259, 270
STRIP_OFFSETS, SAMPLES, STRIP_BYTES, TILE_WIDTH, SAMPLE_FORMAT = 273, 277, 279, 322, 339
X_RESOLUTION, Y_RESOLUTION, PHOTOMETRIC = 282, 283, 262
ROWS_PER_STRIP, PLANAR = 278, 284
LAYOUT = {WIDTH, HEIGHT, BITS, COMPRESSION, PHOTOMETRIC, SAMPLES, SAMPLE_FORMAT, TILE_WIDTH} | {
    ROWS_PER_STRIP,
    PLANAR,
}
INTEGER_TYPES = (3, 4, 16)

FIELD_TYPES = {1: "B", 2: "s", 3: "H", 4: "I", 5: "II", 12: "d", 13: "I", 16: "Q"}
FORMAT_KINDS = {1: "u", 2: "i", 3: "f"}
MOST_VALUES = 1 << 24

Fields = dict[int, tuple[int, tuple[Any, ...]]]
"""Type and values of a directory's fields, by tag."""


@dataclass(frozen=True)
class Page:
    """One image of a TIFF file.

    Attributes
    ----------
    width, height : int
    scalar_type : str
        NumPy's name, for example ``"u2"``.
    samples : int
        Number of values per pixel.
    tiled, palette : bool
    layout : dict
        Type and values of each field that determines how pixels are stored. It must
        be equal for all pages of a stack, including absent fields, as VTK crashes
        on some stacks otherwise.
    calibration : tuple of float or None
        Pixel size along x and y and distance between slices, as written by ImageJ;
        None if the file has none.
    """

    width: int
    height: int
    scalar_type: str
    samples: int
    tiled: bool
    palette: bool
    layout: Fields
    calibration: tuple[float, float, float] | None

    @property
    def type_name(self) -> str:
        """Scalar type for display: ``"float64"``."""
        kind = {"u": "uint", "i": "int", "f": "float"}.get(self.scalar_type[0], "unknown")
        return f"{kind}{float(self.scalar_type[1:]) * 8:g}"


def read_pages(path: Path) -> list[Page]:
    """Read and check a TIFF file's directories.

    Raises
    ------
    VolumeError
        When the file is foreign, a directory is damaged, or pixels lie beyond
        the file's end.
    """
    with path.open("rb") as file:
        try:
            return _Directories(path, file).pages()
        except struct.error:
            raise truncated(path, "a page's directory is cut off") from None


class _Directories:
    """The chain of directories in one open file."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self.path, self.file = path, file
        self.size = path.stat().st_size
        start = file.read(8)
        orders = {b"II": "<", b"MM": ">"}
        self.order = orders.get(start[:2], "")
        version = int.from_bytes(start[2:4], "little" if self.order == "<" else "big")
        if not self.order or version not in (42, 43):
            raise VolumeError(
                f"{path}: this is not a TIFF file; choose another or correct its suffix."
            )
        self.big = version == 43
        self.first = self._unpack("Q" if self.big else "I", 8 if self.big else 4)[0]

    def _unpack(self, form: str, offset: int) -> tuple[Any, ...]:
        form = self.order + form
        self.file.seek(offset)
        return struct.unpack(form, self.file.read(struct.calcsize(form)))

    def pages(self) -> list[Page]:
        """Read all pages of the chain."""
        pages: list[Page] = []
        seen: set[int] = set()
        offset = self.first
        while offset:
            if offset in seen:
                raise damaged(self.path, "its pages form a circle")
            seen.add(offset)
            fields, offset = self._directory(offset)
            pages.append(self._page(fields))
        if not pages:
            raise damaged(self.path, "it has no pages")
        return pages

    def _directory(self, offset: int) -> tuple[Fields, int]:
        """Return the fields of one directory, and the offset of the next."""
        if offset >= self.size:
            raise truncated(self.path, "a page's directory lies beyond its end")
        (count,) = self._unpack("Q" if self.big else "H", offset)
        offset += 8 if self.big else 2
        width = 20 if self.big else 12
        if offset + count * width > self.size:
            raise truncated(self.path, "a page's directory is cut off")
        fields: Fields = {}
        for entry in range(offset, offset + count * width, width):
            tag, kind, length = self._unpack("HHQ" if self.big else "HHI", entry)
            if kind in FIELD_TYPES and tag not in fields:
                fields[tag] = kind, self._values(entry + (12 if self.big else 8), kind, length)
        return fields, self._unpack("Q" if self.big else "I", offset + count * width)[0]

    def _values(self, place: int, kind: int, length: int) -> tuple[Any, ...]:
        """Read the values of a field, stored in its entry if they fit there."""
        if length > MOST_VALUES:
            raise damaged(self.path, "a directory field is impossibly long")
        code = FIELD_TYPES[kind]
        if length * struct.calcsize(self.order + code) > self.size:
            raise truncated(self.path, "a directory field is longer than the file")
        form = f"{length}s" if code == "s" else code * length if code == "II" else f"{length}{code}"
        inline = 8 if self.big else 4
        if struct.calcsize(self.order + form) > inline:
            (place,) = self._unpack("Q" if self.big else "I", place)
        return self._unpack(form, place)

    def _page(self, fields: Fields) -> Page:
        def integers(tag: int, default: tuple[int, ...] = ()) -> tuple[int, ...]:
            kind, values = fields.get(tag, (INTEGER_TYPES[0], default))
            if kind not in INTEGER_TYPES or (default and not values):
                raise damaged(self.path, f"a page's field {tag} is malformed")
            return values

        def one(tag: int, default: int) -> int:
            return integers(tag, (default,))[0]

        bits, kind = one(BITS, 1), FORMAT_KINDS.get(one(SAMPLE_FORMAT, 1), "?")
        page = Page(
            one(WIDTH, 0),
            one(HEIGHT, 0),
            f"{kind}{bits / 8:g}",
            one(SAMPLES, 1),
            TILE_WIDTH in fields,
            one(PHOTOMETRIC, 1) == 3,
            {tag: fields[tag] for tag in LAYOUT if tag in fields},
            _calibration(fields),
        )
        offsets, lengths = integers(STRIP_OFFSETS), integers(STRIP_BYTES)
        if any(o + n > self.size for o, n in zip(offsets, lengths, strict=False)):
            raise truncated(self.path, "a page's pixels lie beyond its end")
        if not page.tiled:
            rows = one(ROWS_PER_STRIP, page.height)
            planes = page.samples if one(PLANAR, 1) == 2 else 1
            strips = -(-page.height // rows) * planes if rows else -1
            if not len(offsets) == len(lengths) == strips:
                raise damaged(self.path, "a page's strips do not add up")
            need = page.width * page.height * page.samples * bits // 8
            if one(COMPRESSION, 1) == 1 and sum(lengths) < need:
                raise damaged(self.path, "a page has fewer pixels than its size says")
        return page


def _calibration(fields: Fields) -> tuple[float, float, float] | None:
    """Return the voxel size from ImageJ's resolution and description, or None."""
    description = b"".join(
        part for part in fields.get(DESCRIPTION, (0, ()))[1] if isinstance(part, bytes)
    )
    resolutions = [fields.get(tag, (0, ()))[1] for tag in (X_RESOLUTION, Y_RESOLUTION)]
    slices = re.search(rb"^spacing=([-+.\deE]+)", description, re.MULTILINE)
    if not description.startswith(b"ImageJ=") or slices is None:
        return None
    if any(len(r) != 2 or 0 in r for r in resolutions):
        return None
    x, y = (denominator / numerator for numerator, denominator in resolutions)
    try:
        return x, y, float(slices.group(1))
    except ValueError:
        return None
