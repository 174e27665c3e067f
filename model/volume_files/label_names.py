"""Names and colours of labels as programs write them, and renumbering for a TF's bins."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.sax.saxutils import unescape

import numpy as np

from model.scene.transfer_function import TF_SAMPLES
from model.scene.volume import Label
from model.volume_files.grid import Grid

Labels = tuple[Label, ...]

LONGEST = 1 << 20  # most bytes of text that are read
_NUMBER = r"[-+.\deE]+"


def slicer_segments(fields: Mapping[str, str]) -> Labels:
    """Labels of a 3D Slicer segmentation, by the key/value pairs of its NRRD head."""
    found = []
    for key, value in fields.items():
        match = re.fullmatch(r"Segment(\d{1,6})_LabelValue", key)
        if match and re.fullmatch(r"\s*-?\d{1,9}\s*", value):
            prefix = f"Segment{match[1]}_"
            color = fields.get(f"{prefix}Color", "").split()
            found.append(_label(value, fields.get(f"{prefix}Name", ""), color, 1.0))
    return tuple(found)


def ome_labels(data: Mapping[str, Any]) -> Labels:
    """Labels of an OME-Zarr group, by its ``image-label``."""
    said = data.get("image-label")
    found: dict[int, list[Any]] = {}
    for key in ("colors", "properties"):
        entries = said.get(key) if isinstance(said, dict) else None
        for entry in entries if isinstance(entries, list) else ():
            value = entry.get("label-value") if isinstance(entry, dict) else None
            if isinstance(value, int):
                both = found.setdefault(value, ["", []])
                both[0] = both[0] or entry.get("name") or entry.get("class") or ""
                both[1] = both[1] or (entry["rgba"] if isinstance(entry.get("rgba"), list) else [])
    return tuple(_label(value, name, color[:3], 255.0) for value, (name, color) in found.items())


def workbench_labels(head: bytes) -> Labels:
    """Labels of a NIfTI file, by the table that Connectome Workbench writes into its head."""
    table = re.search(rb"<LabelTable>.*?</LabelTable>", head, re.DOTALL)
    text = table[0].decode("utf-8", "replace") if table else ""
    found = []
    for attributes, name in re.findall(r"<Label\s([^>]*)>(.*?)</Label>", text, re.DOTALL):
        said = dict(re.findall(r'(\w+)="([^"]*)"', attributes))
        if re.fullmatch(r"-?\d{1,9}", said.get("Key", "")):
            color = [said.get(channel, "") for channel in ("Red", "Green", "Blue")]
            name = unescape(re.sub(r"<!\[CDATA\[(.*?)\]\]>", r"\1", name.strip()))
            found.append(_label(said["Key"], name, color, 1.0))
    return tuple(found)


def snap_labels(path: Path) -> Labels:
    """Labels of an image, by ITK-SNAP's description next to it: its name with .label or .txt."""
    stem = re.sub(r"(\.nii)?(\.gz)?$|\.[^.]*$", "", path.name, count=1)
    found = []
    for place in (path.with_name(f"{stem}.label"), path.with_name(f"{stem}.txt")):
        inside = place.is_file() and place.resolve().parent == path.resolve().parent
        text = place.read_bytes()[:LONGEST].decode("utf-8", "replace") if inside else ""
        line = rf'^\s*(\d{{1,9}})\s+({_NUMBER})\s+({_NUMBER})\s+({_NUMBER})\s.*"(.*)"\s*$'
        for value, *color, name in re.findall(line, text, re.MULTILINE):
            found.append(_label(value, name, color, 255.0))
    return tuple(found)


def distinct_labels(grid: Grid) -> Grid:
    """Return labels that fall into different bins of a TF, renumbered in order if needed."""
    values, labels = grid.values, {label.value: label for label in grid.facts.labels}
    if values.ndim != 3 or float(values.max()) - float(values.min()) < TF_SAMPLES:
        return grid
    found = np.unique(np.concatenate([np.unique(plane) for plane in values]))
    if len(found) >= TF_SAMPLES:
        note = (
            f"There are {len(found)} labels, more than a TF can distinguish: some share a colour."
        )
        return replace(grid, notes=(*grid.notes, note))
    first = int(found[0] != 0)
    numbered = np.empty(values.shape, np.uint8)
    for plane, out in zip(values, numbered, strict=True):
        out[...] = np.searchsorted(found, plane) + first
    named = []
    for number, value in enumerate(found.tolist(), start=first):
        own = labels.get(int(value), Label(int(value)))
        name = f"{value:.12g} {own.name}".rstrip()
        named.append(replace(own, value=number, name=name, number=int(value)))
    last = first + len(found) - 1
    note = (
        f"The labels, up to {found[-1]:g}, are numbered {first} to {last} in their order; each has "
        "the file's number in its name."
    )
    facts = replace(grid.facts, labels=tuple(named))
    return replace(grid, values=numbered, notes=(*grid.notes, note), facts=facts)


def _label(value: Any, name: Any, color: Any, most: float) -> Label:
    """Return a label, without an invalid colour."""
    try:
        r, g, b = (min(max(float(number) / most, 0.0), 1.0) for number in color)
    except (TypeError, ValueError):
        return Label(int(value), str(name).strip())
    return Label(int(value), str(name).strip(), (r, g, b))
