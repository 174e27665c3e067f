"""Masks in files: label volumes of the same grid, as segmentation programs read and write them."""

from __future__ import annotations

import gzip
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError, VolumeError, os_errors_as
from model.files import write_atomically
from model.scene.mask import Mask
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.checks import times

SUFFIXES = (".nrrd", ".nii", ".nii.gz")  # in which masks are written
MOST_LABELS = 4096  # different values that a file of labels may have
ALIKE = 1e-3  # difference of two unit vectors below which two grids are turned alike


def write_mask(path: Path, mask: Mask, volume: Volume) -> None:
    """Write a mask of a volume as labels, 1 where it shows something, whole or not at all.

    The file's grid is the volume's. Raises :class:`TfscopeError` where it cannot be written.
    """
    labels = mask.shown.view(np.uint8)
    name = path.name.lower()
    content = _nifti(labels, volume) if name.endswith(SUFFIXES[1:]) else _nrrd(labels, volume)
    what = f"{path}: the mask cannot be written"
    with os_errors_as(TfscopeError, what, "choose another place"):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, gzip.compress(content, 1) if name.endswith(".gz") else content)


def read_labels(path: Path) -> tuple[Volume, list[float]]:
    """Read a volume of labels, and list the labels but 0.

    Raises :class:`TfscopeError` for what is none.
    """
    volume = read_volume(path)
    values = np.unique(volume.voxels)
    if len(values) > MOST_LABELS:
        raise VolumeError(
            f"{path}: the file has {len(values):,} different values, which are no labels; "
            "choose a mask or a volume of labels."
        )
    return volume, [float(value) for value in values if value != 0]


def read_mask(path: Path, volume: Volume, shown: Collection[float] | None = None) -> Mask | None:
    """Read the mask that shows some labels of a file, all but 0 by default; None shows all."""
    labels, values = read_labels(path)
    return mask_of(labels, volume, values if shown is None else shown)


def mask_of(labels: Volume, volume: Volume, shown: Collection[float]) -> Mask | None:
    """Return the mask of a volume that shows some labels; None shows all voxels.

    Labels of another grid must be resampled before: for them :class:`TfscopeError` is raised.
    """
    if labels.dimensions != volume.dimensions:
        raise TfscopeError(
            f"{labels.name} has {times(labels.dimensions)} voxels and {volume.name} "
            f"{times(volume.dimensions)}: it is no mask of this volume as it is."
        )
    return Mask.of(np.isin(labels.voxels, np.array([*shown], dtype=labels.voxels.dtype)))


def resampled(labels: Volume, volume: Volume) -> Volume:
    """Return labels on a volume's grid: each voxel has the nearest label, and 0 beyond all.

    Raises :class:`TfscopeError` where their files do not say how the grids lie to one another, or
    where they have no place in common.
    """
    own, other = (np.array(each.file.directions or np.eye(3)) for each in (volume, labels))
    units = {each.file.spacing_unit for each in (volume, labels)} - {""}
    spaces = {each.file.space for each in (volume, labels)}
    if len(units) > 1 or len(spaces) > 1 or not np.allclose(own, other, atol=ALIKE):
        raise TfscopeError(
            f"{labels.name} has another grid than {volume.name}, and the files do not say how the "
            "two lie to one another; resample it where it was made."
        )
    offset = own @ (np.array(volume.origin) - np.array(labels.origin))
    voxels: NDArray[np.generic] = labels.voxels
    for axis, (n, step, away, width) in enumerate(
        zip(volume.dimensions, volume.spacing, offset, labels.spacing, strict=True)
    ):
        places = np.rint((away + np.arange(n) * step) / width)
        inside = (places >= 0) & (places < labels.dimensions[axis])
        if not inside.any():
            raise TfscopeError(
                f"{labels.name} has no place in common with {volume.name}; choose another file."
            )
        voxels = voxels.take(np.where(inside, places, 0).astype(np.intp), 2 - axis)
        np.moveaxis(voxels, 2 - axis, 0)[~inside] = 0
    return Volume(voxels, volume.spacing, volume.origin, labels.name, file=labels.file)


def _nrrd(labels: NDArray[np.uint8], volume: Volume) -> bytes:
    axes = _axes(volume)
    vectors = (f"({','.join(repr(float(each)) for each in axis)})" for axis in axes)
    origin = ",".join(repr(float(each)) for each in volume.origin)
    unit, space = volume.file.spacing_unit, volume.file.space
    quoted = f'"{unit}"'
    lines = [
        "NRRD0004",
        "type: uint8",
        "dimension: 3",
        f"space: {space}" if space in ("RAS", "LAS", "LPS") else "space dimension: 3",
        f"sizes: {' '.join(map(str, volume.dimensions))}",
        f"space directions: {' '.join(vectors)}",
        f"space origin: ({origin})",
        *([f"space units: {' '.join([quoted] * 3)}"] if unit else []),
        "kinds: domain domain domain",
        "encoding: gzip",
        # As 3D Slicer writes them: the label's name.
        "Segment0_LabelValue:=1",
        "Segment0_Name:=shown",
    ]
    head = "\n".join(lines).encode() + b"\n\n"
    return head + gzip.compress(labels.tobytes(), 1)


def _nifti(labels: NDArray[np.uint8], volume: Volume) -> bytes:
    from nibabel.nifti1 import Nifti1Image

    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = _axes(volume).T, volume.origin
    # NIfTI's space is RAS.
    signs = {"LPS": (-1, -1, 1), "LAS": (-1, 1, 1)}.get(volume.file.space, (1, 1, 1))
    image: Any = Nifti1Image(labels.T, np.diag([*signs, 1]) @ affine)  # type: ignore[no-untyped-call]
    image.header.set_intent("label")
    if volume.file.spacing_unit in ("mm", "m"):
        image.header.set_xyzt_units({"mm": "mm", "m": "meter"}[volume.file.spacing_unit])
    return bytes(image.to_bytes())


def _axes(volume: Volume) -> NDArray[np.float64]:
    """Vectors (3, 3) from a voxel to the next along x, y and z, in the file's space."""
    return np.array(volume.file.directions or np.eye(3)) * np.array(volume.spacing)[:, None]
