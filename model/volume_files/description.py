"""Description of a volume's file, for people and for programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from model.scene.volume import Content, Volume
from model.volume_files.checks import readable_size, times
from model.volume_files.choice import SINGULARS


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
        rows.append(("values", "labels, by what the file says"))
    if volume.missing_text:
        rows.append(("missing", volume.missing_text))
    if volume.axis_labels:
        x, _, y, _, z, _ = volume.axis_labels
        rows.append(("axes point to", f"{x}, {y}, {z} of the patient"))
    elif _is_turned(volume.file.directions):
        rows.append(("axes point to", "; ".join(_numbers(d) for d in volume.file.directions)))
    rows += [
        (f"also {SINGULARS[content.kind]}", content_text(content))
        for content in volume.file.contents
        if not content.is_read
    ]
    return rows + [("note", note) for note in volume.notes]


def content_text(content: Content) -> str:
    """Describe a content in a line: name, dimensions, type and size."""
    size = f", {readable_size(content.nbytes)}" if content.nbytes else ""
    kind = f" of {content.scalar_type}" if content.scalar_type else ""
    return f"{content.name} ({times(content.dimensions)}{kind}{size})"


def as_data(volume: Volume) -> dict[str, Any]:
    """Return a volume's properties as plain data, for programs.

    Lengths are along x, y and z, that of z stretched; what is unknown is empty. Values are on the
    linear scale.
    """
    volume = volume.linear
    return {
        "name": volume.name,
        "format": volume.file.format,
        "dimensions": list(volume.dimensions),
        "type": str(volume.voxels.dtype),
        "spacing": list(volume.spacing),
        "spacing_unit": volume.file.spacing_unit,
        "stretch": volume.file.stretch,
        "origin": list(volume.origin),
        "directions": [list(direction) for direction in volume.file.directions],
        "space": volume.file.space,
        "axis_labels": list(volume.axis_labels),
        "range": list(volume.data_range),
        "units": volume.units,
        "is_labels": volume.file.is_labels,
        "missing_share": volume.missing_share,
        "nbytes": volume.voxels.nbytes,
        "notes": list(volume.notes),
        "contents": [_content_data(content) for content in volume.file.contents],
    }


def _content_data(content: Content) -> dict[str, Any]:
    data = asdict(content)
    data["dimensions"] = list(content.dimensions)
    data["type"] = data.pop("scalar_type")
    return data


def _is_turned(directions: Sequence[Sequence[float]]) -> bool:
    return bool(directions) and not np.allclose(directions, np.eye(3))


def _numbers(direction: Sequence[float]) -> str:
    return ", ".join(f"{number:.3g}" for number in direction)
