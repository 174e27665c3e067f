"""Masks in files: label volumes of the same grid, as segmentation programs read and write them."""

from __future__ import annotations

import gzip
from collections.abc import Collection
from pathlib import Path

import numpy as np

from model.errors import TfscopeError, VolumeError, os_errors_as
from model.files import write_atomically
from model.scene.mask import Mask
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.checks import times

MOST_LABELS = 4096  # different values that a file of labels may have


def write_mask(path: Path, mask: Mask, volume: Volume) -> None:
    """Write a mask of a volume as NRRD labels, 1 where it shows something, whole or not at all.

    The file's grid is the volume's. Raises :class:`TfscopeError` where it cannot be written.
    """
    facts, unit = volume.file, f'"{volume.file.spacing_unit}"'
    axes = np.array(facts.directions or np.eye(3)) * np.array(volume.spacing)[:, None]
    vectors = [f"({','.join(map(repr, vector))})" for vector in (*axes.tolist(), volume.origin)]
    lines = [
        "NRRD0004",
        "type: uint8",
        "dimension: 3",
        f"space: {facts.space}" if facts.space in ("RAS", "LAS", "LPS") else "space dimension: 3",
        f"sizes: {' '.join(map(str, volume.dimensions))}",
        f"space directions: {' '.join(vectors[:3])}",
        f"space origin: {vectors[3]}",
        *([f"space units: {unit} {unit} {unit}"] if facts.spacing_unit else []),
        "encoding: gzip",
        # As 3D Slicer writes them: the label's name.
        "Segment0_LabelValue:=1",
        "Segment0_Name:=shown",
    ]
    what, head = f"{path}: the mask cannot be written", "\n".join(lines).encode()
    with os_errors_as(TfscopeError, what, "choose another place"):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, head + b"\n\n" + gzip.compress(mask.shown.tobytes(), 1))


def read_labels(path: Path) -> tuple[Volume, list[float]]:
    """Read a volume of labels, and list them but 0; raise :class:`TfscopeError` for none."""
    volume = read_volume(path)
    values = np.unique(volume.voxels)
    if len(values) > MOST_LABELS:
        raise VolumeError(
            f"{path}: the file has {len(values):,} different values, which are no labels; "
            "choose a mask or a volume of labels."
        )
    return volume, [float(value) for value in values if value != 0]


def read_mask(path: Path, volume: Volume) -> Mask | None:
    """Read the mask of a volume that shows a file's labels but 0; None shows all voxels."""
    return mask_of(*read_labels(path), volume)


def mask_of(labels: Volume, shown: Collection[float], volume: Volume) -> Mask | None:
    """Return the mask of a volume that shows some labels; None shows all voxels.

    Raises :class:`TfscopeError` for labels of another grid.
    """
    if labels.dimensions != volume.dimensions:
        raise TfscopeError(
            f"{labels.name} has {times(labels.dimensions)} voxels and {volume.name} "
            f"{times(volume.dimensions)}; resample the mask to the volume's grid."
        )
    return Mask.of(np.isin(labels.voxels, np.array([*shown], dtype=labels.voxels.dtype)))
