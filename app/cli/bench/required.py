"""``bench required``: what inputs and features cost in a picture that does without them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from app.cli.bench.machine import print_machine
from app.cli.console import counting, print_table
from app.cli.outputs import check_output, write_json
from model.errors import RenderError
from model.scene.light import LightDirection, LightRange
from model.scene.scene import Scene
from model.volume_files.shipped import DEFAULT_VOLUME

ROOT = Path(__file__).resolve().parents[3]

LONGEST_S = 600.0


@dataclass(frozen=True)
class Feature:
    """A feature, and by what one sees that a process has it.

    Attributes
    ----------
    modules : tuple of str
        Modules and packages, of libraries too, that only it needs.
    kernels : tuple of str
        Compiled functions that only it needs, as ``module:function``, or all those of a module.
    """

    name: str
    modules: tuple[str, ...] = ()
    kernels: tuple[str, ...] = ()


_RAYCAST = "model.rendering.raycast"

FEATURES = (
    Feature("direct light", kernels=(f"{_RAYCAST}.shading",)),
    Feature("soft light", kernels=(f"{_RAYCAST}.illumination", f"{_RAYCAST}.shading:received")),
    Feature("shadows", kernels=(f"{_RAYCAST}.shadows",)),
    Feature("path-traced light", ("model.rendering.path_tracing",)),
    Feature(
        "pre-integration",
        kernels=(f"{_RAYCAST}.preintegration", f"{_RAYCAST}.cpu:draw_rows_preintegrated"),
    ),
    Feature("missing voxels", kernels=(f"{_RAYCAST}.batch:hide",)),
    Feature("VTK", ("vtkmodules", "model.rendering.vtk_renderer")),
    Feature(
        "regions",
        (
            "model.sensitivity",
            f"{_RAYCAST}.differentiation",
            f"{_RAYCAST}.change_norms",
            f"{_RAYCAST}.shadow_derivatives",
        ),
    ),
    Feature("visible values", ("model.sensitivity", f"{_RAYCAST}.tangents")),
    Feature("models", ("torch", "openvino", "onnxruntime", "model.networks", "model.generator")),
    Feature("map of TFs", ("model.latent", "sklearn", "openTSNE")),
    Feature("compact volumes", ("imagecodecs", "model.evaluation")),
)
"""Features whose first use :mod:`app.cli.bench.required_probe` measures."""

OTHERS = (
    Feature("GPU", ("numba.cuda", f"{_RAYCAST}.cuda")),
    Feature("training", ("model.training", "distributed", "dask")),
    Feature("window", ("PySide6", "pyqtgraph", "app.window")),
    Feature("figures, movies", ("matplotlib", "PIL", "imageio", "app.figures")),
    Feature(
        "other file formats",
        ("h5py", "zarr", "pydicom", "nibabel", "tifffile", "mrcfile", "netCDF4"),
    ),
)
"""Features that a picture has nothing to do with; only looked for."""


def bench_required(path: Path | None, used: bool, json_path: Path | None) -> None:
    """Measure in processes of their own; print tables, and write JSON if requested.

    Parameters
    ----------
    used : bool
        Whether to measure the features' first use, too.
    """
    if json_path is not None:
        check_output(json_path)
    machine = print_machine()
    volume = path or DEFAULT_VOLUME
    uses: dict[str, dict[str, Any]] = {}
    names = [feature.name for feature in FEATURES] if used else []
    with counting("processes", len(names) + 1) as (progress, task):
        plain = probed(volume)
        progress.update(task, completed=1)
        for number, name in enumerate(names):
            uses[name] = probed(volume, name)
            progress.update(task, completed=number + 2)
    print_table(
        f"A plain picture: {plain['ms']:.0f} ms, the first {plain['seconds']:.1f} s; "
        f"{plain['memory']:.0f} MB. With an input that changes nothing",
        ("input", "time", "functions compiled"),
        [(n, f"{r:.3f}", f"{len(plain['added_by_neutral'])}") for n, r in plain["ratios"].items()],
    )
    print_table(
        "Of features that it does without, and their first use",
        ("feature", "modules loaded", "functions compiled", *HEADING),
        [_cells(each, plain, uses.get(each.name)) for each in (*FEATURES, *OTHERS)],
    )
    models = model_bytes()
    print_table(
        "A model's weights, by the inputs that it has",
        ("light", "numbers beside the TFs", "bytes"),
        [(name, f"{numbers}", f"{size:,}") for name, (numbers, size) in models.items()],
    )
    if json_path is not None:
        unused = {f.name: found_in(f, plain) for f in (*FEATURES, *OTHERS)}
        result = {"plain": plain, "unused": unused, "used": uses, "models": models}
        write_json(json_path, {"machine": machine, **result})


HEADING = ("first use, s", "then ms", "MB", "modules", "functions")
"""Columns of a feature's use."""


def probed(volume: Path, feature: str | None = None) -> dict[str, Any]:
    """Run the probe in a process of its own, without any kernels that were compiled before."""
    command = [sys.executable, "-m", "app.cli.bench.required_probe", str(volume.absolute())]
    with tempfile.TemporaryDirectory() as cache:
        place = {"XDG_CACHE_HOME": cache, "LOCALAPPDATA": cache, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            command + ([feature] if feature else []),
            cwd=ROOT,
            env={**os.environ, **place},
            capture_output=True,
            text=True,
            check=False,
            timeout=LONGEST_S,
        )
    lines = done.stdout.strip().splitlines()
    if done.returncode or not lines:
        told = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise RenderError(f"{volume}: {feature or 'a picture'} could not be measured: {told}")
    found: dict[str, Any] = json.loads(lines[-1])
    return found


def found_in(feature: Feature, probe: dict[str, Any]) -> dict[str, list[str]]:
    """Return a feature's modules and compiled functions among those that a probe has found."""
    return {
        "modules": [name for name in probe["modules"] if _is_of(name, feature.modules, ".")],
        "kernels": [
            name
            for name in probe["kernels"]
            if _is_of(name, (*feature.kernels, *_code(feature)), ":")
        ],
    }


def model_bytes() -> dict[str, tuple[int, int]]:
    """Return the numbers that a small model takes beside its TFs, and its bytes, by its light."""
    from model.networks.build import build_generator
    from model.scene.inputs import condition_numbers
    from model.training.options import PRESETS

    size = PRESETS["compact"]
    unlit = Scene("", "", (0.0, 1.0), (0.0, 1.0), size.image_size)
    scenes = {
        "none": unlit,
        "fixed": replace(unlit, lighting="direct", light=LightDirection()),
        "movable": replace(
            unlit, lighting="direct", light=LightDirection(), light_range=LightRange()
        ),
    }
    found = {}
    for name, scene in scenes.items():
        weights = build_generator(size, scene).parameters()
        numbers = condition_numbers(scene)
        found[name] = (numbers, sum(each.numel() * each.element_size() for each in weights))
    return found


def _code(feature: Feature) -> tuple[str, ...]:
    return tuple(name for name in feature.modules if name.startswith("model."))


def _is_of(name: str, prefixes: tuple[str, ...], separator: str) -> bool:
    return any(name == each or name.startswith((each + separator, each + ".")) for each in prefixes)


def _cells(feature: Feature, plain: dict[str, Any], used: dict[str, Any] | None) -> tuple[str, ...]:
    found = found_in(feature, plain)
    unused = f"{len(found['modules'])}", f"{len(found['kernels'])}"
    if used is None:
        return (feature.name, *unused, *[""] * len(HEADING))
    return (
        feature.name,
        *unused,
        f"{used['seconds']:.1f}",
        f"{used['ms']:.0f}",
        f"{used['memory']:.0f}",
        f"{len(used['modules'])}",
        f"{len(used['kernels'])}",
    )
