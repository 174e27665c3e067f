"""Series of slices told apart by the names of their files."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mode

_NUMBER = re.compile(r"-?\d+")
MOST_LISTED = 12


@dataclass(frozen=True)
class NamedSeries:
    """Files whose names differ in one number.

    Attributes
    ----------
    name : str
        What the names have in common, with ``*`` for the number.
    files : tuple of Path
        In the number's order.
    numbers : tuple of int
        One for each file; empty where the files have no number to order them by.
    """

    name: str
    files: tuple[Path, ...]
    numbers: tuple[int, ...] = ()

    @property
    def gap_notes(self) -> tuple[str, ...]:
        """Sentences on numbers that are missing."""
        steps = [b - a for a, b in zip(self.numbers, self.numbers[1:], strict=False)]
        if not steps or len(set(steps)) == 1:
            return ()
        usual = mode(steps)
        if usual < 1:
            return ()
        missing = [
            number
            for first, step in zip(self.numbers, steps, strict=False)
            for number in range(first + usual, first + step, usual)
        ]
        if not missing:
            return ()
        return (
            f"Slices are missing: {listed_numbers(missing)}; those around them are shown "
            "next to each other.",
        )


def listed_numbers(numbers: Sequence[int]) -> str:
    """Format increasing numbers for a sentence, with runs as ``"3 to 9"``."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    texts = []
    for run in runs:
        texts += [f"{run[0]} to {run[-1]}"] if len(run) > 2 else [str(number) for number in run]
    if len(texts) > MOST_LISTED:
        return ", ".join(texts[:MOST_LISTED]) + f" and more, {len(numbers)} in all"
    return " and ".join([", ".join(texts[:-1]), texts[-1]]) if len(texts) > 1 else texts[0]


def natural_key(path: Path) -> list[tuple[int, str]]:
    """Sort key that puts slice 9 before slice 10."""
    return [
        (int(word), "") if word.isdigit() and word.isascii() else (0, word)
        for word in re.split(r"(\d+)", path.name.lower())
    ]


def named_series(files: Sequence[Path]) -> list[NamedSeries]:
    """Group files by what their names have in common but for the number of the slice.

    That number is the one with the most values, or the last of these. A minus before it is a
    sign only if some of the names have none there. Files that have nothing in common are one
    series, in natural order.

    Returns
    -------
    list of NamedSeries
        The longest first.
    """
    frames: dict[str, list[Path]] = defaultdict(list)
    for path in files:
        frames[_NUMBER.sub("#", path.name)].append(path)
    found = [series for alike in frames.values() for series in _split(alike)]
    if max(len(series.files) for series in found) < 2:
        ordered = sorted(files, key=natural_key)
        return [NamedSeries("*" + ordered[0].suffix, tuple(ordered))]
    return sorted(found, key=lambda series: (-len(series.files), series.name))


def _split(files: list[Path]) -> list[NamedSeries]:
    """Split files whose names differ in numbers only."""
    rows = [_NUMBER.findall(path.name) for path in files]
    columns = list(zip(*rows, strict=True))
    signed = [0 < sum(word[0] == "-" for word in column) < len(column) for column in columns]
    values = [
        [int(word) if is_signed else int(word.lstrip("-")) for word in column]
        for column, is_signed in zip(columns, signed, strict=True)
    ]
    counts = [len(set(column)) for column in values]
    if not counts or max(counts) < 2:
        return [NamedSeries(path.name, (path,)) for path in files]
    slice_column = max(range(len(counts)), key=lambda k: (counts[k], k))
    series: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for row in range(len(files)):
        others = tuple(column[row] for k, column in enumerate(values) if k != slice_column)
        series[others].append(row)
    if len(series) > len(files) / 2:
        # Every slice has more than one number of its own, such as the time of its taking.
        series = {(): list(range(len(files)))}
        slice_column = counts.index(max(counts))
    named = []
    for members in series.values():
        numbers = values[slice_column]
        members.sort(key=lambda row: (numbers[row], natural_key(files[row])))
        ordered = tuple(files[row] for row in members)
        name = _with_star(ordered[0].name, slice_column)
        named.append(NamedSeries(name, ordered, tuple(numbers[row] for row in members)))
    return named


def _with_star(name: str, column: int) -> str:
    """Replace one of a name's numbers, and its sign, by a star."""
    place = list(_NUMBER.finditer(name))[column]
    return f"{name[: place.start()]}*{name[place.end() :]}"
