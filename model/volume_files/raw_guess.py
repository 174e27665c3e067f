"""Guessing the layout of a headerless file from its name, its size and its values."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from model.volume_files.checks import unreadable
from model.volume_files.raw import LONGEST_HEADER, ByteOrder, RawLayout
from model.volume_files.raw_name import NameFacts, facts_of
from model.volume_files.raw_smoothness import Smoothness

SHORTEST, LONGEST = 4, 8192
"""Fewest and most voxels along an axis that are guessed."""

LARGEST_RATIO = 40
"""Largest ratio of two dimensions that is guessed without the name's help."""

MOST_GUESSES = 8

HEADERS = (512, 1024, 128, 256, 348, 352, 2048, 4096, 20, 16, 12)
"""Lengths of headers that are tried where the name's dimensions do not fit the whole file."""

TYPES_TRIED, ROWS_TRIED = 4, 6
"""Types, and lengths of rows of each, that are tried in full."""

_TYPES = (
    "uint8", "uint16", "int16", "float32", "int8", "float64", "int32", "uint32", "int64", "uint64",
)  # fmt: skip
"""From the most to the least common."""

RARITY = 0.002
"""Disadvantage of a type against the one that is next more common, as a smoothness."""

UNEVENNESS = 0.015
"""Disadvantage of dimensions for each doubling of their ratio, as a smoothness."""

AGAINST_NAME, NAMED = 3.0, 10.0
"""Disadvantage of what contradicts the name, and advantage of dimensions that it gives.

Both are larger than any difference in smoothness.
"""

BIG_ENDIAN = 0.001
"""Disadvantage of the big byte order, as a smoothness."""


@dataclass(frozen=True)
class _Reading:
    """One way to read the values, and their smoothness."""

    scalar_type: str
    byte_order: ByteOrder
    count: int
    smoothness: Smoothness
    handicap: float

    @property
    def dtype(self) -> np.dtype[np.generic]:
        """Type of the values, without byte order."""
        return np.dtype(self.scalar_type)


def guess_layouts(path: Path) -> list[RawLayout]:
    """Guess the layout of a headerless file.

    Returns
    -------
    list of RawLayout
        At most 8 layouts that need exactly the file's bytes, most plausible first: those
        that agree with the file's name, then those under which neighbouring voxels differ
        least. A layout that the name gives in full, but that does not fit, is the last.
        Empty if nothing fits.

    Raises
    ------
    VolumeError
        When the file cannot be read.
    """
    try:
        return _guesses(Path(path))
    except OSError as error:
        raise unreadable(path, error) from None


def _guesses(path: Path) -> list[RawLayout]:
    size = path.stat().st_size
    facts = _with_bits(facts_of(path), size)
    ranked: dict[RawLayout, float] = {}
    if size >= SHORTEST**3:
        for reading in _best_readings(path, size, facts):
            ranked |= _ranked_layouts(reading, facts)
    guesses = sorted(ranked, key=lambda layout: ranked[layout])[:MOST_GUESSES]
    named = RawLayout.parse(path.stem)
    if named is not None and named not in guesses and math.prod(named.dimensions) > 0:
        more = size - named.nbytes
        if 0 < more <= LONGEST_HEADER:
            named = replace(named, offset=named.offset + more)
        first = more >= 0 and named.nbytes == size
        guesses = [named, *guesses] if first else [*guesses[: MOST_GUESSES - 1], named]
    given = facts.dimensions
    if len(given) == 3 and all(guess.dimensions != given for guess in guesses):
        guesses = [*_behind_headers(path, size, facts), *guesses]
    return guesses[:MOST_GUESSES]


def _behind_headers(path: Path, size: int, facts: NameFacts) -> list[RawLayout]:
    """Guess layouts of the name's dimensions behind a header of a usual length."""
    ranked: dict[RawLayout, float] = {}
    for offset in HEADERS:
        rest = size - offset
        own = _with_bits(facts, rest)
        if rest < SHORTEST**3 or not own.bits or rest * 8 != own.bits * math.prod(own.dimensions):
            continue
        for reading in _best_readings(path, rest, own, offset):
            for layout, rank in _ranked_layouts(reading, own).items():
                if layout.dimensions == own.dimensions:
                    ranked[replace(layout, offset=offset)] = rank
    return sorted(ranked, key=lambda layout: ranked[layout])[:MOST_GUESSES]


def _with_bits(facts: NameFacts, size: int) -> NameFacts:
    """Add the size of a value where the name's dimensions and the file's size give it."""
    bits, rest = divmod(8 * size, max(math.prod(facts.dimensions), 1))
    if len(facts.dimensions) < 3 or rest or bits not in (8, 16, 32, 64):
        return facts
    fits = facts.scalar_type and 8 * np.dtype(facts.scalar_type).itemsize == bits
    return replace(facts, bits=bits, scalar_type=facts.scalar_type if fits else "")


def _best_readings(path: Path, size: int, facts: NameFacts, offset: int = 0) -> list[_Reading]:
    """Return the types and byte orders under which successive values differ least."""
    found = []
    for rarity, scalar_type in enumerate(_TYPES):
        dtype = np.dtype(scalar_type)
        if size % dtype.itemsize or size // dtype.itemsize < SHORTEST**3:
            continue
        orders: tuple[ByteOrder, ...] = ("little",) if dtype.itemsize == 1 else ("little", "big")
        for order in orders:
            handicap = RARITY * rarity + (BIG_ENDIAN if order == "big" else 0)
            handicap += _against_name(facts, scalar_type, dtype.itemsize, order)
            smoothness = Smoothness(path, dtype.newbyteorder(order), offset)
            if smoothness.is_plausible:
                count = size // dtype.itemsize
                found.append(_Reading(scalar_type, order, count, smoothness, handicap))
    found = [reading for reading in found if not _is_overruled(reading, found)]
    found.sort(key=lambda reading: reading.handicap + reading.smoothness.at(1))
    return found[:TYPES_TRIED]


def _is_overruled(reading: _Reading, readings: list[_Reading]) -> bool:
    """Whether another type or byte order explains an integer type's values far better.

    Integers that are read with a wrong sign jump wherever they cross 0, and wherever their low
    byte overflows if the order is wrong. Floating-point numbers are as smooth when they are
    read as enormous integers.
    """
    if reading.dtype.kind == "f":
        return False
    alike = [
        other
        for other in readings
        if other.dtype.itemsize == reading.dtype.itemsize
        and other.handicap < reading.handicap + AGAINST_NAME
    ]
    return any(
        other.byte_order == reading.byte_order
        if other.dtype.kind == "f"
        else 2 * other.smoothness.step < reading.smoothness.step
        for other in alike
    )


def _against_name(facts: NameFacts, scalar_type: str, itemsize: int, order: ByteOrder) -> float:
    """Return a disadvantage of types that differ from what the name says."""
    wrong = 0.0
    if facts.scalar_type:
        wrong += AGAINST_NAME * (facts.scalar_type != scalar_type)
    elif facts.bits:
        wrong += AGAINST_NAME * (facts.bits != 8 * itemsize)
    if facts.byte_order and itemsize > 1:
        wrong += AGAINST_NAME * (facts.byte_order != order)
    return wrong


def _ranked_layouts(reading: _Reading, facts: NameFacts) -> dict[RawLayout, float]:
    """Return layouts of one type, each with its rank: the lower, the more plausible."""
    smoothness = reading.smoothness
    ranked = {}
    for dimensions in _named_dimensions(reading.count, facts):
        # Far before all others, but among themselves by smoothness.
        ranked[dimensions] = _roughness(smoothness, dimensions) - NAMED
    for dimensions in _smoothest_dimensions(reading):
        roughness = _roughness(smoothness, dimensions)
        unevenness = UNEVENNESS * math.log2(max(dimensions) / min(dimensions))
        ranked.setdefault(dimensions, roughness + unevenness)
    return {
        RawLayout(d, reading.scalar_type, reading.byte_order): rank + reading.handicap
        for d, rank in ranked.items()
    }


def _roughness(smoothness: Smoothness, dimensions: tuple[int, int, int]) -> float:
    """Sum of the relative differences of neighbours along x, y and z."""
    nx, ny, _ = dimensions
    return smoothness.at(1) + smoothness.at(nx) + smoothness.at(nx * ny)


def _named_dimensions(count: int, facts: NameFacts) -> Iterator[tuple[int, int, int]]:
    """Yield dimensions of this many voxels that the name suggests."""
    if len(facts.dimensions) >= 2:
        # Even if the number of slices is wrong, as of a file that was cut off.
        nx, ny = facts.dimensions[:2]
        if min(nx, ny) > 1 and count % (nx * ny) == 0 and count // (nx * ny) > 1:
            yield nx, ny, count // (nx * ny)
    else:
        for side in facts.numbers:
            if side**3 == count:
                yield side, side, side


def _smoothest_dimensions(reading: _Reading) -> Iterator[tuple[int, int, int]]:
    """Yield dimensions whose rows have one of the lengths at which values differ least."""
    count, smoothness = reading.count, reading.smoothness
    sides = _divisors(count)
    rows = [nx for nx in sides if any(True for _ in _completions(nx, count, sides))]
    rows.sort(key=smoothness.at)
    for nx in rows[:ROWS_TRIED]:
        yield from _completions(nx, count, sides)


def _completions(nx: int, count: int, sides: list[int]) -> Iterator[tuple[int, int, int]]:
    """Yield all dimensions of this many voxels with rows of one length."""
    for ny in sides:
        nz, rest = divmod(count // nx, ny)
        if rest or not SHORTEST <= nz <= LONGEST:
            continue
        if max(nx, ny, nz) <= LARGEST_RATIO * min(nx, ny, nz):
            yield nx, ny, nz


def _divisors(count: int) -> list[int]:
    """Divisors that may be dimensions, lowest first."""
    numbers = np.arange(SHORTEST, min(LONGEST, count) + 1)
    return [int(n) for n in numbers[count % numbers == 0]]
