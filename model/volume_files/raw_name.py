"""The layout of a headerless file, by its name and its size."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from model.volume_files.raw import LONGEST_HEADER, SCALAR_TYPES, ByteOrder, RawLayout

_TRIPLE = re.compile(r"(?<!\d)(\d{1,5})([x×_ -])(\d{1,5})\2(\d{1,5})(?!\d)", re.IGNORECASE)
_PAIR = re.compile(r"(?<!\d)(\d{2,5})[x×](\d{2,5})(?!\d)", re.IGNORECASE)
_BITS = re.compile(r"(?<!\d)(8|16|32|64)[ _-]?b(?:its?)?(?![a-z])", re.IGNORECASE)
_WORD = re.compile(r"[a-z]+(?:8|16|32|64)?(?![a-z\d])", re.IGNORECASE)

_TYPES = {
    **SCALAR_TYPES,
    **{f"{short}{bits}": f"{long}{bits}" for bits in (8, 16, 32, 64)
       for short, long in (("u", "uint"), ("ui", "uint"), ("i", "int"), ("s", "int"))},
    **{"f32": "float32", "f64": "float64", "ubyte": "uint8", "byte": "uint8"},
}  # fmt: skip

_COMMON = {8: "uint8", 16: "uint16", 32: "float32", 64: "float64"}
"""The most common type of values of so many bits."""

_ORDERS: dict[str, ByteOrder] = {
    **dict.fromkeys(("bigendian", "msb"), "big"),
    **dict.fromkeys(("littleendian", "lsb"), "little"),
}
_ORDERS_AFTER_TYPE: dict[str, ByteOrder] = {
    "be": "big", "big": "big", "le": "little", "little": "little", **_ORDERS,
}  # fmt: skip
"""Words that mean something else elsewhere, as in ``big_foot``."""


@dataclass(frozen=True)
class NameFacts:
    """What a file's name says: two or three dimensions, numbers that may be a cube's side, a type,
    the bits of a value, the byte order; each part may be missing.
    """

    dimensions: tuple[int, int, int] | tuple[int, int] | tuple[()] = ()
    numbers: tuple[int, ...] = ()
    scalar_type: str = ""
    bits: int = 0
    byte_order: ByteOrder | None = None


def facts_of(path: Path) -> NameFacts:
    """Read a file's name, such as ``head-512x512-16bit`` or ``fuel64``; the last of two counts."""
    text = path.stem
    dimensions: tuple[int, int, int] | tuple[int, int] | tuple[()] = ()
    if triples := list(_TRIPLE.finditer(text)):
        dimensions = (int(triples[-1][1]), int(triples[-1][3]), int(triples[-1][4]))
        text = _without(text, triples[-1])
    elif pairs := list(_PAIR.finditer(text)):
        dimensions = (int(pairs[-1][1]), int(pairs[-1][2]))
        text = _without(text, pairs[-1])
    bits = 0
    if sizes := list(_BITS.finditer(text)):
        bits = int(sizes[-1][1])
        text = _without(text, sizes[-1])
    words = list(_WORD.finditer(text))
    types = [word for word in words if word.group().lower() in _TYPES]
    scalar_type, order = "", None
    if types:
        scalar_type = SCALAR_TYPES[_TYPES[types[-1].group().lower()]]
    for word in words:
        known = _ORDERS_AFTER_TYPE if types and word.start() > types[0].start() else _ORDERS
        order = known.get(word.group().lower(), order)
    for word in reversed(types):
        text = _without(text, word)
    numbers = tuple(int(n) for n in re.findall(r"(?<!\d)\d{1,5}(?!\d)", text))
    return NameFacts(dimensions, numbers, scalar_type, bits, order)


def guess_layout(path: Path, size: int) -> RawLayout | None:
    """Return the layout that a name gives, or the file's size where only one is possible.

    It needs exactly these bytes, perhaps behind a header; or is the one that the name gives in
    full, though it does not fit. None if several fit, or none.
    """
    named = RawLayout.parse(path.stem)
    if named is not None and named.nbytes == size:
        return named
    facts = facts_of(path)
    names = [facts.scalar_type] if facts.scalar_type else list(_COMMON.values())
    if facts.bits and not facts.scalar_type:
        names = [_COMMON[facts.bits]]
    fitting = [
        RawLayout(dimensions, name, facts.byte_order or "little")
        for name in names
        for dimensions in _dimensions(facts, size, np.dtype(name).itemsize)
    ]
    exact = [layout for layout in fitting if layout.nbytes == size]
    if len(exact) == 1:
        return exact[0]
    if exact or len(facts.dimensions) < 3 or len(names) > 1:
        return None
    more = size - fitting[0].nbytes
    return replace(fitting[0], offset=more) if 0 < more <= LONGEST_HEADER else fitting[0]


def _dimensions(facts: NameFacts, size: int, itemsize: int) -> list[tuple[int, int, int]]:
    """Return the dimensions that the name suggests, or a cube, for values of a number of bytes."""
    if len(facts.dimensions) == 3:
        return [facts.dimensions]
    count = size // itemsize
    if len(facts.dimensions) == 2:
        nx, ny = facts.dimensions
        slices = count // max(nx * ny, 1)
        return [(nx, ny, slices)] if slices > 1 else []
    side = round(count ** (1 / 3))
    return [(side, side, side)] if side > 1 and side in (facts.numbers or (side,)) else []


def _without(text: str, found: re.Match[str]) -> str:
    """Return a text with a match replaced by a blank."""
    return f"{text[: found.start()]} {text[found.end() :]}"
