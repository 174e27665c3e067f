"""Masks in files: labels as segmentation programs read and write them."""

import gzip
from collections.abc import Collection
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError, VolumeError, os_errors_as
from model.files import write_atomically
from model.scene.distribution import Distribution
from model.scene.mask import Mask
from model.scene.volume import Label, Volume
from model.volume_files import read_volume
from model.volume_files.checks import times
from model.volume_files.grid import METRES, is_space

SUFFIXES = (".nrrd", ".nii.gz", ".nii")  # suffixes of written files
MOST_LABELS = 4096  # different values that a file of labels may have
MOST_COUNTED = 1 << 16  # largest difference of values that are counted one by one, which is faster
MOST_NAMED = 12  # number of values that an error names
ALIKE = 0.5  # distance in voxels up to which two grids count as the same
EDGE = np.uint8(2)  # label of a stored mask's edge
WIDEST = 1 << 15  # number of voxels along an axis that NIfTI-1 can no longer store


@dataclass(frozen=True, eq=False)
class LabelMap:
    """Labels of a file, on the grid of a volume."""

    name: str
    voxels: NDArray[np.generic]  # (nz, ny, nx), 0 where there is no label
    values: tuple[float, ...]  # existing labels
    named: tuple[Label, ...] = ()  # labels that the file names or colours
    note: str = ""  # how they were resampled onto the volume's grid, if so

    def label(self, value: float) -> Label:
        """Return what the file says of a value."""
        return next((each for each in self.named if isclose(each.value, value)), Label(int(value)))

    def names(self, value: float) -> list[str]:
        """Return a label's number in the file, and its name if it has one."""
        label = self.label(value)
        number = f"{value if label.number is None else label.number:.12g}"
        # A renumbered one has the file's number in its name.
        name = label.name if label.number is None else label.name.removeprefix(number).strip()
        return [number, *filter(None, [name])]

    def named_by(self, text: str) -> list[float]:
        """Parse numbers and names of labels, separated by commas."""
        known = {value: self.names(value) for value in self.values}
        found, words = list[float](), text.split(",")
        while words:
            # Names may have commas, too: the longest one counts.
            for count in range(len(words), 0, -1):
                word = ",".join(words[:count]).strip()
                fits = [v for v, names in known.items() if word.lower() in map(str.lower, names)]
                if fits or not word:
                    break
            else:
                there = [" ".join(names) for names in known.values()]
                there[MOST_NAMED:] = ["…"] * (len(there) > MOST_NAMED)
                raise TfscopeError(f"{self.name} has no label '{word}'; it has {', '.join(there)}.")
            found += fits
            del words[:count]
        return found

    def mask(self, shown: Collection[float]) -> Mask | None:
        """Return the mask that shows some labels; None shows all voxels."""
        return Mask.of(np.isin(self.voxels, np.array([*shown], dtype=self.voxels.dtype)))

    def shown_by(self, mask: Mask | None) -> Collection[float]:
        """Return the labels that a mask shows at least in part; all if it shows none."""
        if mask is None:
            return self.values
        found = _values(np.where(mask.exact.shown, self.voxels, 0))
        return [float(value) for value in found if value != 0] or self.values


def read_labels(path: Path, volume: Volume, is_kept: bool = False) -> LabelMap:
    """Read labels for a volume; those of another grid are resampled, and a note says so.

    Voxels correspond by number, as another spacing may have been typed since. Raises
    :class:`TfscopeError` for a file without labels, or with a grid of unknown place.
    """
    labels = read_volume(path, is_mask=True)
    if labels.missing is not None:
        labels = replace(labels, voxels=np.where(labels.missing, 0, labels.voxels), missing=None)
    is_same = is_kept and labels.dimensions == volume.dimensions
    voxels, note = (labels.voxels, "") if is_same else _on_grid(labels, volume)
    values = _values(voxels)
    if len(values) > MOST_LABELS:
        raise VolumeError(
            f"{path}: the file has {len(values):,} different values, too many for labels; "
            "choose a mask or a volume of labels."
        )
    found = tuple(float(value) for value in values if value != 0)
    return LabelMap(labels.name, voxels, found, labels.file.labels, note)


def _values(voxels: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return the voxels' distinct values in increasing order."""
    counted = Distribution(voxels)
    is_counted = voxels.dtype.kind in "iu" and np.ptp(counted.range) < MOST_COUNTED
    return counted.frequencies[0] if is_counted else np.unique(voxels)


def read_mask(path: Path, volume: Volume) -> Mask | None:
    """Read a stored mask: all labels but 0, of which 2 is its edge; None shows all voxels."""
    labels = read_labels(path, volume, is_kept=True)
    mask = labels.mask(labels.values)
    return None if mask is None else mask.with_edge(np.packbits(labels.voxels == EDGE))


def _on_grid(labels: Volume, volume: Volume) -> tuple[NDArray[np.generic], str]:
    """Return the label at each voxel of a volume, and a note on resampling.

    If both files place their grids in one space, it is the nearest label; else the grids must have
    the same size.
    """
    is_alike = labels.dimensions == volume.dimensions
    spaces = {is_space(each.file.space) or each.file.space for each in (labels, volume)}
    # ITK, with which most masks are made, reads a space without a name as LPS.
    is_assumed = spaces == {True, ""} and not is_alike
    there, here = (_frame(each, "LPS" if is_assumed else "") for each in (labels, volume))
    if there is None or here is None or (len(spaces) > 1 and not is_assumed):
        if is_alike:
            return labels.voxels, ""
        raise TfscopeError(
            f"{labels.name} has {times(labels.dimensions)} voxels and {volume.name} "
            f"{times(volume.dimensions)}, and the files do not say how these lie in one space; "
            "resample the mask to the volume's grid."
        )
    # Homogeneous matrix from the volume's voxel numbers to the labels'.
    change = np.linalg.inv(there) @ here
    corners = np.array(list(np.ndindex(2, 2, 2))) * (np.array(volume.dimensions) - 1)
    found = corners @ change[:3, :3].T + change[:3, 3]
    if is_alike and np.abs(found - corners).max() < ALIKE:
        return labels.voxels, ""
    from scipy.ndimage import affine_transform

    backwards, shape = change[:3, :3][::-1, ::-1], volume.voxels.shape
    voxels = affine_transform(
        labels.voxels, backwards, change[2::-1, 3], shape, order=0, mode="grid-constant"
    )
    if voxels.any():
        where = "lies elsewhere" if is_alike else "differs"
        note = f"The grid of {labels.name} {where}, so each voxel takes the nearest label."
        unnamed = volume.name if is_space(labels.file.space) else labels.name
        return voxels, f"{note} {unnamed} names no space: LPS is assumed." if is_assumed else note
    if is_alike:
        return labels.voxels, (
            f"The files say that {labels.name} lies elsewhere than {volume.name}. As both have as "
            "many voxels, each takes the label of the same number."
        )
    raise TfscopeError(
        f"{labels.name} has no label where {volume.name} lies; choose a mask of this volume."
    )


def _frame(volume: Volume, assumed: str = "") -> NDArray[np.float64] | None:
    """Homogeneous matrix (4, 4) from voxel numbers to the file's space (RAS in metres), or None."""
    facts = volume.file
    if not facts.directions:
        return None
    frame, (steps, origin) = np.eye(4), _unstretched(volume)
    frame[:3, :3], frame[:3, 3] = np.array(facts.directions).T * steps, origin
    space = facts.space or assumed
    if is_space(space):
        to_ras = np.zeros((4, 4))
        for k, letter in enumerate(space):
            to_ras["RLAPSI".index(letter) // 2, k] = 1 if letter in "RAS" else -1
        to_ras[3, 3] = 1
        frame = to_ras @ frame
    frame[:3] *= METRES.get(facts.spacing_unit.lower(), METRES["mm"])
    return frame if abs(np.linalg.det(frame[:3, :3])) > 0 else None


def _unstretched(volume: Volume) -> NDArray[np.float64]:
    """Spacing and origin of a volume (2, 3) as in its file."""
    return np.array([volume.spacing, volume.origin]) / (1, 1, volume.file.stretch)


def write_mask(path: Path, mask: Mask, volume: Volume) -> None:
    """Write a mask of a volume as labels: 1 for shown voxels, 2 for those of its edge.

    The file is complete or not there, and has the volume's grid; it is NIfTI by its name, else
    NRRD. Raises :class:`TfscopeError` if it cannot be written.
    """
    what, name = f"{path}: the mask cannot be written", path.name.lower()
    with os_errors_as(TfscopeError, what, "make room, or choose another place"):
        path.parent.mkdir(parents=True, exist_ok=True)
        if name.endswith((".nii", ".nii.gz")):
            content = _nifti(mask, volume)
            write_atomically(path, gzip.compress(content, 1) if name.endswith(".gz") else content)
        else:
            write_atomically(path, _nrrd_head(volume) + gzip.compress(_labels(mask).tobytes(), 1))


def _labels(mask: Mask) -> NDArray[np.uint8]:
    shown = mask.shown.view(np.uint8)
    return np.where(mask.exact.shown, shown, EDGE * shown) if mask.edge else shown


def _nrrd_head(volume: Volume) -> bytes:
    facts, unit = volume.file, f'"{volume.file.spacing_unit}"'
    spacing, origin = _unstretched(volume)
    axes = np.array(facts.directions or np.eye(3)) * spacing[:, None]
    vectors = [f"({','.join(map(repr, vector))})" for vector in [*axes.tolist(), origin.tolist()]]
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
        # The label's name as 3D Slicer writes it.
        "Segment0_LabelValue:=1",
        "Segment0_Name:=shown",
    ]
    return "\n".join(lines).encode() + b"\n\n"


def _nifti(mask: Mask, volume: Volume) -> bytes:
    import nibabel

    kind: Any = nibabel.Nifti1Image if max(mask.shape) < WIDEST else nibabel.Nifti2Image
    image = kind(_labels(mask).T, None)
    header, metres = image.header, METRES.get(volume.file.spacing_unit.lower())
    # In millimetres, as NIfTI has few units.
    in_mm = 1.0 if metres is None else metres / METRES["mm"]
    header.set_zooms(_unstretched(volume)[0] * in_mm)
    header.set_xyzt_units("unknown" if metres is None else "mm")
    header.set_intent("label")
    frame = _frame(volume)
    if frame is not None and is_space(volume.file.space):
        frame[:3] /= METRES["mm"]
        image.set_qform(frame, "scanner")
        image.set_sform(frame, "scanner")
    return bytes(image.to_bytes())
