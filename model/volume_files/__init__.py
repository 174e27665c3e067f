"""Reading volumes from files.

:func:`read_volume` takes any supported file or folder; :func:`describe` lists
what was read. VTK is imported only when a file needs it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from model.errors import VolumeError
from model.scene.volume import Volume
from model.volume_files.checks import readable_size, times, unreadable
from model.volume_files.dicom import SUFFIXES as DICOM_SUFFIXES
from model.volume_files.dicom import dicom_slices, read_dicom
from model.volume_files.dicom_tags import is_dicom
from model.volume_files.finish import Component, make_volume
from model.volume_files.grid import Grid
from model.volume_files.legacy_vtk import read_legacy_vtk
from model.volume_files.metaimage import read_metaimage
from model.volume_files.nifti import read_nifti
from model.volume_files.nrrd import read_nrrd
from model.volume_files.raw import RawLayout, read_raw
from model.volume_files.tiff import read_tiff, read_tiff_folder, tiff_slices
from model.volume_files.vti import read_vti

__all__ = ["SUFFIXES", "Component", "RawLayout", "describe", "read_volume"]

_READERS: dict[str, Callable[[Path], Grid]] = {
    ".nrrd": read_nrrd,
    ".nhdr": read_nrrd,
    ".mha": read_metaimage,
    ".mhd": read_metaimage,
    ".nii": read_nifti,
    ".nii.gz": read_nifti,
    ".vti": read_vti,
    ".vtk": read_legacy_vtk,
    ".tif": read_tiff,
    ".tiff": read_tiff,
}

SUFFIXES = (*_READERS, *DICOM_SUFFIXES, ".raw")
"""Suffixes of the files that can be read, for file dialogs."""


def read_volume(
    path: Path, *, raw: RawLayout | None = None, component: Component | None = None
) -> Volume:
    """Read a volume from a file, or from a folder of DICOM or TIFF slices.

    Parameters
    ----------
    path : Path
        NRRD, MetaImage, NIfTI, VTI, legacy VTK, TIFF, DICOM or raw.
    raw : RawLayout or None
        Layout to read the file with as a headerless one, regardless of its suffix.
        Without it, a .raw file must have the layout in its name, for example
        ``engine_256x256x110_uint8.raw``.
    component : int, "magnitude" or None
        Component to read from a file with several components per voxel.

    Returns
    -------
    Volume
        In index order: axis x of the volume is the file's fastest axis.
        Assumptions and changes are recorded in its notes.

    Raises
    ------
    VolumeError
        For every file that is not a volume or cannot be read; the message is one
        sentence with the reason.
    """
    path = Path(path)
    try:
        _check_path(path)
        return make_volume(path, _read_grid(path, raw), component)
    except OSError as error:
        raise unreadable(path, error) from None
    except MemoryError:
        raise VolumeError(
            f"{path}: there is not enough free memory for this volume; "
            "close other programs, or crop or downsample it."
        ) from None


def describe(volume: Volume) -> list[tuple[str, str]]:
    """List a volume's properties for display.

    Returns
    -------
    list of (str, str)
        Label and text; one row per note at the end.
    """
    low, high = volume.scalar_range
    rows = [
        ("name", volume.name),
        ("dimensions", f"{times(volume.dimensions)} voxels"),
        ("type", str(volume.scalars.dtype)),
        ("spacing", " x ".join(f"{s:g}" for s in volume.spacing)),
        ("origin", ", ".join(f"{o:g}" for o in volume.origin)),
        ("scalar range", f"{low:g} to {high:g}"),
        ("units", volume.units or "unknown"),
        ("size in memory", readable_size(volume.scalars.nbytes)),
    ]
    if volume.missing_text:
        rows.append(("missing", volume.missing_text))
    if volume.axis_labels:
        x, _, y, _, z, _ = volume.axis_labels
        rows.append(("axes point to", f"{x}, {y}, {z} of the patient"))
    return rows + [("note", note) for note in volume.notes]


def _check_path(path: Path) -> None:
    if not path.exists():
        raise VolumeError(f"{path}: there is no such file or folder; check the path.")
    if path.is_dir():
        return
    if not path.is_file():
        raise VolumeError(f"{path}: this is neither a file nor a folder; choose a volume file.")
    with path.open("rb") as file:
        if not file.read(1):
            raise VolumeError(f"{path}: the file is empty (0 bytes); copy or download it again.")


def _read_grid(path: Path, raw: RawLayout | None) -> Grid:
    if path.is_dir():
        return _read_folder(path)
    suffix = "".join(path.suffixes[-2:] if path.suffix.lower() == ".gz" else path.suffixes[-1:])
    suffix = suffix.lower()
    if raw is not None or suffix == ".raw":
        return read_raw(path, raw)
    if suffix in _READERS:
        return _READERS[suffix](path)
    if suffix in DICOM_SUFFIXES or is_dicom(path):
        return read_dicom(dicom_slices(path.parent), like=path)
    raise VolumeError(
        f"{path}: files of the kind '{suffix or path.name}' are not known here; "
        f"supported are {', '.join(SUFFIXES)} and folders of DICOM or TIFF slices."
    )


def _read_folder(folder: Path) -> Grid:
    if slices := dicom_slices(folder):
        return read_dicom(slices)
    if slices := tiff_slices(folder):
        return read_tiff_folder(folder, slices)
    raise VolumeError(
        f"{folder}: the folder holds no DICOM or TIFF slices; "
        "choose a volume file or another folder."
    )
