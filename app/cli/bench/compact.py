"""``bench compact``: what the bytes of a compact volume are worth."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from app.cli.bench.machine import print_machine
from app.cli.console import console, print_table
from app.cli.outputs import write_json
from model.benchmarks.compact import CompactRow, compare_compressors
from model.volume_files import read_volume
from model.volume_files.checks import times
from model.volume_files.shipped import shipped_volumes


def bench_compact(
    paths: list[Path] | None,
    rates: list[float],
    images: int,
    rivals: bool,
    json_path: Path | None,
) -> None:
    """Compress each volume to some sizes; print a table, and write JSON if requested."""
    machine = print_machine()
    found: dict[str, list[CompactRow]] = {}
    for path in paths or shipped_volumes():
        volume = read_volume(path)
        rows = list(compare_compressors(volume, rates, images, rivals))
        name = f"{volume.name}, {times(volume.dimensions)} {volume.voxels.dtype}"
        found[name] = rows
        _print(f"{name}, {images} images", rows)
    for index, rate in enumerate(rates):
        own = [[r for r in rows if r.name in OWN][index] for rows in found.values()]
        mean = float(np.mean([row.rmse for row in own]))
        console.print(f"{rate:.4g} bytes a voxel: mean error {mean:.4f} of {len(own)} volumes")
    if json_path is not None:
        plain = {name: [asdict(row) for row in rows] for name, rows in found.items()}
        write_json(json_path, {"machine": machine, "images": images, "volumes": plain})


OWN = ("compact volume", "without loss")


def _print(title: str, rows: list[CompactRow]) -> None:
    cells = [
        (
            row.name,
            f"{row.bytes_a_voxel:.4f}",
            f"{row.rmse:.4f}",
            f"{row.largest:.4f}",
            f"{row.write_seconds:.2f}",
            f"{row.read_seconds:.2f}",
        )
        for row in rows
    ]
    heading = ("", "bytes a voxel", "image RMSE", "largest", "written in s", "read in s")
    print_table(title, heading, cells)
