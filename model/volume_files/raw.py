"""Headerless raw volumes: layouts, given or from the file's name, and previews."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.volume import FileFacts, Triple
from model.volume_files.blocks import Block, read_block
from model.volume_files.checks import check_grid, number_of, readable_size, times, unreadable
from model.volume_files.grid import Grid, placed

LONGEST_HEADER = 1 << 16  # most bytes that count as a header

ByteOrder = Literal["little", "big"]

SCALAR_TYPES = {
    **{name: name for name in ("int8", "int16", "int32", "int64", "float32", "float64")},
    **{name: name for name in ("uint8", "uint16", "uint32", "uint64")},
    **{"uchar": "uint8", "ushort": "uint16", "uint": "uint32"},
    **{"char": "int8", "short": "int16", "int": "int32", "float": "float32", "double": "float64"},
}
"""NumPy's names of scalar types, by their common names."""

_DIMENSIONS = re.compile(r"(?<!\d)(\d{1,9})x(\d{1,9})x(\d{1,9})(?!\d)", re.IGNORECASE)
_SPACING = re.compile(r"spacing=([\d.e+-]+),([\d.e+-]+),([\d.e+-]+)", re.IGNORECASE)
_OFFSET = re.compile(r"(?:offset|skip|header)=(\d{1,15})", re.IGNORECASE)
_WORD = re.compile(r"[a-z]+\d*", re.IGNORECASE)
_BIG = {"be", "big", "bigendian", "msb"}


@dataclass(frozen=True)
class RawLayout:
    """Layout of a headerless file, x fastest; VolumeError for an invalid one."""

    dimensions: tuple[int, int, int]
    scalar_type: str
    byte_order: ByteOrder = "little"
    spacing: Triple | None = None
    offset: int = 0

    def __post_init__(self) -> None:
        if self.scalar_type not in SCALAR_TYPES:
            raise VolumeError(
                f"'{self.scalar_type}' is not a scalar type of raw volumes; "
                f"use one of {', '.join(sorted(set(SCALAR_TYPES.values())))}."
            )
        if self.byte_order not in ("little", "big"):
            raise VolumeError(f"'{self.byte_order}' is not a byte order; use little or big.")
        if self.offset < 0:
            raise VolumeError(f"{self.offset} bytes cannot be skipped; give 0 or more.")

    @classmethod
    def parse(cls, text: str) -> RawLayout | None:
        """Parse a layout such as ``engine_256x256x110_uint8_be spacing=0.5,0.5,1 offset=512``.

        None without dimensions or scalar type, or with an invalid spacing. The byte order is little
        unless a word after the dimensions is ``be``, ``big``, ``bigendian`` or ``msb``.
        """
        found = list(_DIMENSIONS.finditer(text))
        if not found:
            return None
        nx, ny, nz = (int(n) for n in found[-1].groups())
        words = [word.lower() for word in _WORD.findall(text[found[-1].end() :])]
        types = [word for word in words if word in SCALAR_TYPES]
        if not types:
            return None
        order: ByteOrder = "big" if _BIG.intersection(words) else "little"
        spacing, skipped = _SPACING.search(text), _OFFSET.search(text)
        steps = [number_of(word) for word in spacing.groups()] if spacing else []
        if None in steps:
            return None
        sizes = cast(Triple | None, tuple(steps) or None)
        return cls((nx, ny, nz), types[0], order, sizes, int(skipped[1]) if skipped else 0)

    @property
    def text(self) -> str:
        """Text for :meth:`parse`."""
        words = "x".join(map(str, self.dimensions)) + f"_{self.scalar_type}"
        words += "_be" if self.byte_order == "big" else ""
        if self.spacing is not None:
            words += " spacing=" + ",".join(f"{float(s)!r}" for s in self.spacing)
        return words + (f" offset={self.offset}" if self.offset else "")

    @property
    def nbytes(self) -> int:
        """Size of a file of this layout."""
        return self.offset + math.prod(self.dimensions) * self.dtype.itemsize

    @property
    def dtype(self) -> np.dtype[np.generic]:
        """Scalar type with byte order."""
        return np.dtype(SCALAR_TYPES[self.scalar_type]).newbyteorder(self.byte_order)


def read_raw(path: Path, layout: RawLayout | None) -> Grid:
    """Read a raw file of exactly the layout's size."""
    layout = layout or RawLayout.parse(path.stem)
    if layout is None:
        raise VolumeError(
            f"{path}: a raw file does not say its dimensions and scalar type; "
            "give them, or put them into the name, for example engine_256x256x110_uint8.raw.",
            raw="256x256x110_uint8",
        )
    check_grid(path, layout.dimensions, layout.dtype)
    more = path.stat().st_size - layout.nbytes
    if more:
        skipped = replace(layout, offset=layout.offset + more) if more > 0 else layout
        suggested = {"raw": skipped.text} if 0 < more <= LONGEST_HEADER else {}
        said = fit_sentence(layout, layout.nbytes + more)
        raise VolumeError(f"{path}: {said}", **suggested)
    values = read_block(Block(path, layout.dimensions[::-1], layout.dtype, layout.offset))
    return placed(Grid(values, facts=FileFacts("raw")), layout.spacing)


# --- layouts by names ---------------------------------------------------------------------

_TRIPLE = re.compile(r"(?<!\d)(\d{1,5})([x×_ -])(\d{1,5})\2(\d{1,5})(?!\d)", re.IGNORECASE)
_PAIR = re.compile(r"(?<!\d)(\d{2,5})[x×](\d{2,5})(?!\d)", re.IGNORECASE)
_BITS = re.compile(r"(?<!\d)(8|16|32|64)[ _-]?b(?:its?)?(?![a-z])", re.IGNORECASE)
_NAME = re.compile(r"[a-z]+(?:8|16|32|64)?(?![a-z\d])", re.IGNORECASE)

_TYPES = {
    **SCALAR_TYPES,
    **{f"{short}{bits}": f"{long}{bits}" for bits in (8, 16, 32, 64)
       for short, long in (("u", "uint"), ("ui", "uint"), ("i", "int"), ("s", "int"))},
    **{"f32": "float32", "f64": "float64", "ubyte": "uint8", "byte": "uint8"},
}  # fmt: skip
_COMMON = {8: "uint8", 16: "uint16", 32: "float32", 64: "float64"}  # the most common by bits

_ORDERS = ("bigendian", "msb", "littleendian", "lsb")
"""Words for byte orders; shorter ones mean something else before the type, as in ``big_foot``."""


def guess_layout(path: Path, size: int) -> RawLayout | None:
    """Return the layout by a file's name, or by its size if only one fits.

    ``head-512x512-16bit`` says two dimensions and the size of a value, ``fuel64`` suggests a cube;
    the last of two counts. The layout needs exactly these bytes, perhaps after a header; a layout
    given in full by the name need not fit. None if several fit, or none.
    """
    named = RawLayout.parse(path.stem)
    if named is not None and named.nbytes == size:
        return named
    triple, text = _taken(_TRIPLE, path.stem)
    pair, text = (None, text) if triple else _taken(_PAIR, text)
    sides = [int(triple[k]) for k in (1, 3, 4)] if triple else []
    sides = [int(pair[1]), int(pair[2])] if pair else sides
    bits, text = _taken(_BITS, text)
    words = [*_NAME.finditer(text)]
    types = [word for word in words if word.group().lower() in _TYPES]
    order: ByteOrder = "little"
    for word in words:
        is_after = bool(types) and word.start() > types[0].start()
        name = word.group().lower()
        if name in _ORDERS or (is_after and name in ("be", "big", "le", "little")):
            order = "big" if name[0] in "bm" else "little"
    names = [SCALAR_TYPES[_TYPES[types[-1].group().lower()]]] if types else [*_COMMON.values()]
    if bits and not types:
        names = [_COMMON[int(bits[1])]]
    rest = _NAME.sub(lambda word: " " if word[0].lower() in _TYPES else word[0], text)
    numbers = [int(number) for number in re.findall(r"(?<!\d)\d{1,5}(?!\d)", rest)]
    fitting = [
        RawLayout(dimensions, name, order)
        for name in names
        for dimensions in _dimensions(sides, numbers, size // np.dtype(name).itemsize)
    ]
    exact = [layout for layout in fitting if layout.nbytes == size]
    if len(exact) == 1:
        return exact[0]
    if exact or len(sides) < 3 or len(names) > 1:
        return None
    more = size - fitting[0].nbytes
    return replace(fitting[0], offset=more) if 0 < more <= LONGEST_HEADER else fitting[0]


def _taken(pattern: re.Pattern[str], text: str) -> tuple[re.Match[str] | None, str]:
    """Return the last match and the text without it."""
    found = [*pattern.finditer(text)]
    if not found:
        return None, text
    return found[-1], f"{text[: found[-1].start()]} {text[found[-1].end() :]}"


def _dimensions(sides: list[int], numbers: list[int], count: int) -> list[tuple[int, int, int]]:
    """Return the dimensions that a name suggests, or a cube, for this many values."""
    if len(sides) == 3:
        return [(sides[0], sides[1], sides[2])]
    if len(sides) == 2:
        slices = count // max(sides[0] * sides[1], 1)
        return [(sides[0], sides[1], slices)] if slices > 1 else []
    side = round(count ** (1 / 3))
    return [(side, side, side)] if side > 1 and side in (numbers or [side]) else []


# --- previews -----------------------------------------------------------------------------

PREVIEW_SIZE = 256  # most pixels of a preview along either side
PERCENTILES = 1.0, 99.0  # percentiles of the slice's values that are shown black and white


def preview(path: Path, layout: RawLayout, axis: int) -> NDArray[np.uint8]:
    """Return a picture of the middle slice across an axis, up to 256 pixels along each side.

    Only this slice is read; voxels that the file lacks are black. Columns run along x, or along y
    across x; rows along y, or along z from the bottom upwards.
    """
    try:
        values, usable = _slice(path, layout, axis)
    except OSError as error:
        raise unreadable(path, error) from None
    return _gray(values, usable)


def file_size(path: Path) -> int:
    """Return the bytes of a file; raise VolumeError if there is none."""
    try:
        return path.stat().st_size
    except OSError as error:
        raise unreadable(path, error) from None


def _slice(
    path: Path, layout: RawLayout, axis: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Read a middle slice: its values, and which exist and are finite."""
    places: list[NDArray[np.int64]] = [
        np.arange(0, n, max(math.ceil(n / PREVIEW_SIZE), 1)) for n in layout.dimensions
    ]
    places[axis] = np.array([layout.dimensions[axis] // 2])
    x, y, z = places
    nx, ny, _ = layout.dimensions
    voxels = (z[:, None, None] * ny + y[:, None]) * nx + x
    plane = np.squeeze(voxels, axis=2 - axis)
    if axis != 2:
        plane = plane[::-1]
    present = max(path.stat().st_size - layout.offset, 0) // layout.dtype.itemsize
    if present == 0:
        return np.zeros(plane.shape), np.zeros(plane.shape, np.bool_)
    values = np.memmap(path, layout.dtype, "r", layout.offset, (present,))
    inside = plane < present
    with np.errstate(invalid="ignore", over="ignore"):
        shown = np.asarray(values[np.where(inside, plane, 0)]).astype(np.float64)
    return shown, inside & np.isfinite(shown)


def _gray(values: NDArray[np.float64], usable: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Scale values between percentiles to 0..255; unusable ones are black."""
    if not usable.any():
        return np.zeros(values.shape, np.uint8)
    low, high = np.percentile(values[usable], PERCENTILES)
    if low == high:
        # Few voxels differ from the background: show them.
        low, high = values[usable].min(), values[usable].max()
    # Halves, as a whole range may overflow.
    high = np.inf if low == high else high
    shades = np.interp(values / 2, (low / 2, high / 2), (0.0, 255.0))
    return np.rint(np.where(usable, shades, 0.0)).astype(np.uint8)


def fit_sentence(layout: RawLayout, present: int) -> str:
    """Compare a layout's bytes with the file's, and suggest what would fit."""
    need = layout.nbytes
    what = f"{times(layout.dimensions)} voxels of {layout.scalar_type} need {_bytes(need)}"
    if layout.offset:
        what = what.replace(" need ", f" behind {layout.offset:,} bytes need ")
    if need == present:
        return f"{what}, which is what the file has."
    gap = f"{abs(need - present):,} bytes {'too few' if present < need else 'too many'}"
    if remedies := _remedies(layout, present):
        advice = f" It would fit with {', or '.join(remedies)}."
    elif 0 < present - need <= LONGEST_HEADER:
        skip = layout.offset + present - need
        advice = f" A header? It would fit with {skip:,} bytes skipped."
    elif present < need:
        advice = " It is truncated, or the dimensions or the type are wrong."
    else:
        advice = " The dimensions or the type are wrong, or other data follow."
    return f"{what}; the file has {_bytes(present)}, {gap}.{advice}"


def _bytes(count: int) -> str:
    size = readable_size(count)
    return f"{count:,} bytes" if "bytes" in size else f"{count:,} bytes ({size})"


def _remedies(layout: RawLayout, present: int) -> list[str]:
    """Return the single changes of a layout that make it fit."""
    found: list[str] = []
    voxels = math.prod(layout.dimensions)
    present -= layout.offset
    if present <= 0:
        return []
    size, rest = divmod(present, voxels)
    if not rest:
        # One common type per size is enough to suggest a width.
        common = ("uint8", "uint16", "float32", "float64")
        found += [name for name in common if np.dtype(name).itemsize == size]
    for axis in (2, 1, 0):
        others = voxels // layout.dimensions[axis] * layout.dtype.itemsize
        count, rest = divmod(present, others)
        if not rest and count > 1:
            found.append(f"{count:,} voxels along {'xyz'[axis]}")
    return found
