"""``bench jumps``: whether pictures change evenly while a TF is edited."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.cli.bench.machine import print_machine
from app.cli.bench.path import VIEWS
from app.cli.console import print_table
from app.cli.outputs import write_json
from model.benchmarks.jumps import LIMIT, largest_jump
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.setting import smooth_distance
from model.scene.first_picture import first_picture
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

USUAL_DISTANCE = 0.5
"""Between samples that are compared with VTK's, in voxels; pictures' are closer."""

LIGHTS: tuple[Lighting, ...] = ("none", "direct", "shadows", "soft")


def bench_jumps(paths: list[Path] | None, size: int, steps: int, json_path: Path | None) -> None:
    """Move the highest mode of each volume's first TF in all lights; print tables, write JSON."""
    machine = print_machine()
    found: dict[str, Any] = {}
    cells = []
    for path in paths or shipped_volumes():
        volume, tf = first_picture(read_volume(path))
        jumps = {}
        for lighting in LIGHTS:
            light = None if lighting == "none" else LightDirection()
            distance = smooth_distance(USUAL_DISTANCE, lighting)
            renderer = RaycastRenderer(volume, lighting, sample_distance=distance)
            inputs = SceneInputs.of(VIEWS[0], tf, light=light)
            jumps[lighting] = largest_jump(renderer, inputs, size, steps)
            renderer.close()
        cells.append((volume.name, *(f"{jump.largest:.2f}" for jump in jumps.values())))
        found[volume.name] = {lighting: asdict(jump) for lighting, jump in jumps.items()}
    title = f"Largest second difference in 8-bit steps, {size} x {size}, {steps} steps (< {LIMIT})"
    print_table(title, ("volume", *LIGHTS), cells)
    if json_path is not None:
        write_json(json_path, {"machine": machine, "volumes": found})
