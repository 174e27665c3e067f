"""``bench extremes``: largest errors at the extremes, as tables and as the document's page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.cli.bench.machine import machine_text, print_machine
from app.cli.console import console, counting, print_facts, print_table
from app.cli.outputs import check_output, write_json, write_text
from model.benchmarks.extreme_errors import (
    CODES,
    PICTURES,
    SENSITIVITIES,
    Found,
    Row,
    measure_extremes,
)
from model.benchmarks.extremes import extremes, refused

SECTIONS = {
    "Pictures": ("pictures", tuple(PICTURES)),
    "Sensitivities": ("sensitivities", tuple(SENSITIVITIES)),
    "Codes": ("codes", tuple(CODES)),
}
"""Tables by their title: the part of a row, and its columns."""

OPENING = """\
# Numerics at the extremes

Every picture, sensitivity and code at the extremes of what tfscope takes, against plain NumPy in
64-bit arithmetic ([reference_raycaster.py](../model/benchmarks/reference_raycaster.py) and
[reference_light.py](../model/benchmarks/reference_light.py), which share no code with the
renderers). This page is made anew by

    python main.py bench extremes --out docs/numerics.md

and its bounds are held by `make test-all`. What cannot be drawn [says why](#refused); nothing is
NaN, and nothing that shows something is black.

The scene is a smooth random volume of 17 x 20 x 14 voxels with homogeneous pieces, drawn in 24 x
24 pixels with samples half a voxel apart, unless the row says otherwise."""

EXPLANATIONS = {
    "Pictures": """\
Largest error of any channel of any pixel: of the ray caster (first five columns) as a share of
the picture's brightest number, of VTK and the path tracer of full brightness.

- The ray caster may be 1/510 off in all: what is fainter than that behind or beside something is
  skipped. Its opacities are looked up at 16 places a bin, which a TF of a single bin shows.
- Under direct light up to three faint samples share their shading; in shadows, their light.
- VTK has 8 bits and reads TFs at 1,024 places; its shading works with 32 bits on the graphics
  card.
- Path-traced opacity is the ray caster's. The light is tested where it is known: a white medium
  under an even white sky is as bright as it is opaque, however often light is scattered. Pixels
  of an opacity below .001 stay black.""",
    "Sensitivities": """\
Largest error as a share of the largest derivative, along four edits of the TF: two single bins,
and two of 20 and 12 bins. *Plot* is the derivative of the picture's norm, *field* that of each
pixel. The reference differentiates by complex numbers, so its derivative is as exact as its
picture.

- A single bin has 16 places for its opacities, too: where it is the only one that shows, pixels
  are a sixth off.
- In shadows, samples share light that changes little. What a pixel's derivative loses by that is
  up to a fifth of the largest one, while plots, which are sums, hardly lose anything.""",
    "Codes": """\
Largest error of a voxel of a compact volume as a share of the range of values, without loss and
in 1 byte a voxel; and largest difference of the opacities that the shipped TF codec gives back in
32 and in 64 bits.""",
}


def bench_extremes(vtk: bool, json_path: Path | None, out: Path | None) -> None:
    """Measure all extremes; print tables, and write JSON and the document's page if requested."""
    for path in (json_path, out):
        if path is not None:
            check_output(path)
    machine = print_machine()
    rows: list[Row] = []
    with counting("extremes", len(extremes())) as (progress, task):
        for done, _total, row in measure_extremes(vtk=vtk):
            rows.append(row)
            progress.update(task, completed=done)
    messages = refused()
    for title, (part, columns) in SECTIONS.items():
        print_table(title, ("", "", *columns), _cells(rows, part, columns), left=2)
    print_facts("Refused", list(messages.items()))
    if json_path is not None:
        plain = [_plain(row) for row in rows]
        write_json(json_path, {"machine": machine, "extremes": plain, "refused": messages})
    if out is not None:
        write_text(out, page(rows, messages, machine_text(machine)))
        console.print(f"{out}")


def page(rows: Sequence[Row], messages: Mapping[str, str], machine: str) -> str:
    """Return the document's page in Markdown."""
    parts = [OPENING, f"({machine}.)"]
    for title, (part, columns) in SECTIONS.items():
        cells = _cells(rows, part, columns)
        parts += [f"## {title}", EXPLANATIONS[title], _table(("", "", *columns), cells)]
    said = [(name, message) for name, message in messages.items()]
    parts += ["## Refused", _table(("input", "what is said"), said)]
    return "\n\n".join(parts) + "\n"


def error_text(found: Found) -> str:
    """Say an error in few characters, or why there is none."""
    if isinstance(found, str):
        return found
    if not math.isfinite(found):
        return "not finite"
    if found == 0:
        return "0"
    if found < 1e-4:
        return f"{found:.0e}".replace("e-0", "e-")
    return f"{found:.4f}".lstrip("0") if found < 0.001 else f"{found:.3f}".lstrip("0")


def _cells(rows: Sequence[Row], part: str, columns: Sequence[str]) -> list[tuple[str, ...]]:
    cells, before = [], ""
    for row in rows:
        found: dict[str, Found] = getattr(row, part)
        if not found:
            continue
        kind, before = ("" if row.kind == before else row.kind), row.kind
        texts = (error_text(found[name]) if name in found else "" for name in columns)
        cells.append((kind, row.name, *texts))
    return cells


def _table(heading: Sequence[str], cells: Sequence[Sequence[str]]) -> str:
    lines = [heading, ["---"] * len(heading), *cells]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _plain(row: Row) -> dict[str, Any]:
    data = asdict(row)
    for part, _ in SECTIONS.values():
        # JSON has no NaN.
        data[part] = {
            name: found if isinstance(found, str) or math.isfinite(found) else str(found)
            for name, found in data[part].items()
        }
    return data
