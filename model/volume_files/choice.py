"""The choice among a file's or folder's volumes, and descriptions of the one read."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike

from model.errors import VolumeError
from model.scene.volume import ChoiceKind, Content, Volume
from model.volume_files.checks import readable_size, times

AskedKind = Literal["series", "array", "time", "channel"]
"""Kinds of contents that a :class:`Choice` chooses from; components are separate."""

PLURALS = {
    "series": "series", "array": "arrays", "time": "time steps", "channel": "channels",
    "component": "components",
}  # fmt: skip
SINGULARS = {**PLURALS, "array": "array", "time": "time step", "channel": "channel"}
MOST_LISTED = 12  # names in a sentence; the others are counted


@dataclass(frozen=True)
class Choice:
    """Choice of what to read from a file or folder of several volumes.

    Each is a name, a number from 0, or "magnitude" (components); None: the largest or first.
    `spacing` and `stretch` were typed in place of the file's; see ``typed_spacing``.
    """

    series: str | None = None
    array: str | None = None
    time: str | None = None
    channel: str | None = None
    component: str | None = None
    spacing: str | None = None
    stretch: str | None = None

    @classmethod
    def parse(cls, text: str) -> Choice:
        """Rebuild a choice from its :attr:`text`, without invalid parts."""
        parts = dict(re.findall(r"(\w+)=((?:[^;\\]|\\.)*)(?:;|$)", text))
        kinds = [field.name for field in fields(cls) if field.name in parts]
        return cls(**{kind: re.sub(r"\\(.)", r"\1", parts[kind]) for kind in kinds})

    @property
    def text(self) -> str:
        """The choice as one line, such as ``series=CT;time=3``; empty if nothing is chosen."""
        chosen = ((field.name, getattr(self, field.name)) for field in fields(Choice))
        return ";".join(
            f"{name}=" + re.sub(r"([;\\])", r"\\\1", value)
            for name, value in chosen
            if value is not None
        )


LARGEST = Choice()  # the largest volume, or the first of several


def content(
    kind: ChoiceKind, name: str, dimensions: Sequence[int], dtype: DTypeLike, is_read: bool
) -> Content:
    """Describe one content."""
    scalar_type, sizes = np.dtype(dtype), tuple(int(n) for n in dimensions)
    size = math.prod(sizes) * scalar_type.itemsize
    return Content(kind, name, sizes, scalar_type.name, size, is_read)


def contents(
    kind: AskedKind, names: Sequence[str], dimensions: Sequence[int], dtype: DTypeLike, read: int
) -> tuple[Content, ...]:
    """List contents of equal size, such as the channels of an image; empty if there is only one."""
    if len(names) < 2:
        return ()
    return tuple(content(kind, each, dimensions, dtype, k == read) for k, each in enumerate(names))


def chosen_index(
    path: Path, kind: AskedKind, names: Sequence[str], wanted: str | None, default: int = 0
) -> int:
    """Return the index of the content with a name, or a number from 0; None for the default."""
    if wanted is None:
        return default
    if wanted in names:
        return names.index(wanted)
    alike = [number for number, name in enumerate(names) if name.lower() == wanted.lower()]
    if len(alike) == 1:
        return alike[0]
    if re.fullmatch(r"\d{1,9}", wanted) and int(wanted) < len(names):
        return int(wanted)
    listed = ", ".join(names[:MOST_LISTED])
    listed += f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    raise VolumeError(
        f"{path}: there is no {SINGULARS[kind]} '{wanted}'; "
        f"there {'are' if len(names) > 1 else 'is'} {listed or 'none'}."
    )


def chosen(
    path: Path,
    kind: AskedKind,
    names: int | Sequence[str],
    choice: Choice,
    dimensions: Sequence[int],
    dtype: DTypeLike,
) -> tuple[int, tuple[Content, ...]]:
    """Return the chosen index and all contents of equal size, from `names` or a count."""
    if isinstance(names, int):
        names = [str(k) for k in range(names)]
    number = chosen_index(path, kind, names, getattr(choice, kind))
    return number, contents(kind, names, dimensions, dtype, number)


def choice_notes(contents: Sequence[Content]) -> tuple[str, ...]:
    """Sentences on what was read, one for each kind."""
    notes = []
    for kind in dict.fromkeys(content.kind for content in contents):
        alike = [content for content in contents if content.kind == kind]
        read = next((content for content in alike if content.is_read), None)
        if read is None or len(alike) < 2:
            continue
        others = [content.name for content in alike if not content.is_read]
        if all(re.fullmatch(r"\d+", name) for name in (read.name, *others)):
            between = "and" if len(alike) == 2 else "to"
            rest = f"they are {alike[0].name} {between} {alike[-1].name}"
        else:
            rest = ", ".join(others[:MOST_LISTED])
            left = len(others) - MOST_LISTED
            rest = f"also there: {rest}" + (f" and {left} more" if left > 0 else "")
        sizes = len({content.dimensions for content in alike})
        size = f" ({times(read.dimensions)})" if sizes > 1 else ""
        notes.append(f"Of {len(alike)} {PLURALS[kind]} '{read.name}' is read{size}; {rest}.")
    return tuple(notes)


def describe(volume: Volume) -> list[tuple[str, str]]:
    """List a volume's properties as labels and texts, one row for each content and note."""
    volume = volume.linear
    low, high = volume.data_range
    spacing = *volume.spacing[:2], volume.spacing[2] / volume.file.stretch
    unit = f" {volume.file.spacing_unit}" if volume.file.spacing_unit else ""
    rows = [("name", volume.name)]
    if volume.file.format:
        rows.append(("format", volume.file.format))
    rows += [
        ("dimensions", f"{times(volume.dimensions)} voxels"),
        ("type", str(volume.voxels.dtype)),
        ("spacing", " x ".join(f"{s:g}" for s in spacing) + unit),
        ("origin", ", ".join(f"{o:g}" for o in volume.origin) + unit),
        ("scalar range", f"{low:g} to {high:g}"),
        ("units", volume.units or "unknown"),
        ("size in memory", readable_size(volume.voxels.nbytes)),
    ]
    if volume.file.stretch != 1.0:
        rows.append(("z is drawn", f"{volume.file.stretch:.4g} times as long"))
    if volume.file.is_labels:
        rows.append(("values", "labels, according to the file"))
        rows += [(f"label {label.value}", label.name) for label in volume.file.labels if label.name]
    if volume.missing_text:
        rows.append(("missing", volume.missing_text))
    if volume.axis_labels:
        x, _, y, _, z, _ = volume.axis_labels
        rows.append(("axes point to", f"{x}, {y}, {z} of the patient"))
    elif (turned := volume.file.directions) and not np.allclose(turned, np.eye(3)):
        axes = (", ".join(f"{number:.3g}" for number in direction) for direction in turned)
        rows.append(("axes point to", "; ".join(axes)))
    if not volume.axis_labels:
        rows.append(("orientation", "not given by the file; left and right may be swapped"))
    for other in volume.file.contents:
        if not other.is_read:
            size = f", {readable_size(other.nbytes)}" if other.nbytes else ""
            kind = f" of {other.scalar_type}" if other.scalar_type else ""
            text = f"{other.name} ({times(other.dimensions)}{kind}{size})"
            rows.append((f"also {SINGULARS[other.kind]}", text))
    return rows + [("note", note) for note in volume.notes]


def as_data(volume: Volume) -> dict[str, Any]:
    """Return a volume's properties on the linear scale as plain data.

    Lengths are along x, y and z, with z stretched; unknown ones are empty.
    """
    volume = volume.linear
    file = asdict(volume.file)
    for each in file["contents"]:
        each["type"] = each.pop("scalar_type")
    return {
        **file,
        "name": volume.name,
        "dimensions": volume.dimensions,
        "type": str(volume.voxels.dtype),
        "spacing": volume.spacing,
        "origin": volume.origin,
        "axis_labels": volume.axis_labels,
        "range": volume.data_range,
        "units": volume.units,
        "missing_share": volume.missing_share,
        "nbytes": volume.voxels.nbytes,
        "notes": volume.notes,
    }
