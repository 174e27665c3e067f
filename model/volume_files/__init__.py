"""Reading volumes from files: :func:`read_volume` takes any supported file or folder."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from model.errors import VolumeError
from model.scene.volume import Volume
from model.volume_files import dicom, tiff
from model.volume_files.arrays import read_numpy
from model.volume_files.checks import unreadable
from model.volume_files.choice import LARGEST, Choice, describe
from model.volume_files.dicom import dicom_slices, read_dicom
from model.volume_files.dicom_tags import is_dicom
from model.volume_files.finish import component_of, make_volume
from model.volume_files.foreign import folder_advice, folder_of_slices, foreign_advice, suffix_of
from model.volume_files.grid import Grid
from model.volume_files.hdf5 import read_hdf5
from model.volume_files.mrc import read_mrc
from model.volume_files.nifti import read_nifti
from model.volume_files.nrrd_metaimage import read_metaimage, read_nrrd
from model.volume_files.raw import RawLayout, read_raw
from model.volume_files.tiff import read_tiff
from model.volume_files.tiff_folder import read_tiff_folder, tiff_slices
from model.volume_files.vtk_images import read_legacy_vtk, read_vti
from model.volume_files.zarr_arrays import is_zarr, read_zarr

__all__ = ["SUFFIXES", "Choice", "RawLayout", "describe", "read_volume"]

_KINDS: tuple[tuple[str, bytes, Callable[[Path, Choice], Grid]], ...] = (
    (".nrrd .nhdr", rb"NRRD000", read_nrrd),
    (".mha .mhd", rb"ObjectType = Image", read_metaimage),
    (".nii .nii.gz .hdr .img .img.gz .mgh .mgz", rb".{344}n[+i]1\0", read_nifti),
    (".vti", rb'(?=.*"ImageData").*<VTKFile', read_vti),
    (".vtk", rb"# vtk DataFile", read_legacy_vtk),
    (" ".join(tiff.SUFFIXES), rb"II[*+]\0|MM\0[*+]", read_tiff),
    (".mrc .rec .map .ccp4 .mrcs .st .ali .mrc.gz .map.gz", rb".{208}MAP ", read_mrc),
    (".npy .npz", rb"\x93NUMPY", read_numpy),
    (".h5 .hdf5 .hdf .he5 .ims .vtkhdf .mat", rb"(.{512})?\x89HDF\r\n\x1a\n", read_hdf5),
    (".nc .nc4 .cdf", rb"CDF[\1\2]", read_hdf5),
)
"""Suffixes of files, their first bytes, and their readers."""

_READERS = {suffix: reader for suffixes, _, reader in _KINDS for suffix in suffixes.split()}
SUFFIXES = (*_READERS, *dicom.SUFFIXES, ".raw")  # for file dialogs


def read_volume(
    path: Path, *, raw: RawLayout | None = None, choice: Choice = LARGEST, is_mask: bool = False
) -> Volume:
    """Read a volume from a file of any supported kind, or from a folder of DICOM or TIFF slices.

    Without a layout, a .raw file must have one in its name, such as
    ``engine_256x256x110_uint8.raw``. Axis x is the file's fastest. Notes give assumptions and
    changes. Raises VolumeError for all others, in a sentence with a remedy, and unless it is a mask
    for a volume of one value.
    """
    path = Path(path)
    try:
        _check_path(path)
        component_of(choice.component)
        volume = make_volume(path, _read_grid(path, raw, choice), choice)
    except OSError as error:
        raise unreadable(path, error) from None
    except MemoryError:
        raise VolumeError(
            f"{path}: there is not enough free memory for this volume; "
            "close other programs, or crop or downsample it."
        ) from None
    if volume.distribution.is_constant and not is_mask:
        raise VolumeError(
            f"{path}: every voxel has the value {volume.data_range[0]:g}; "
            "a constant volume shows nothing, so choose another file or component."
        )
    return volume


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


def _read_grid(path: Path, raw: RawLayout | None, choice: Choice) -> Grid:
    if path.is_dir():
        return _read_folder(path, choice)
    suffix = suffix_of(path)
    if raw is not None or suffix == ".raw":
        return read_raw(path, raw)
    by_content, note = _kind_by_content(path), "By its content this is a {}, and it is read as one."
    if by_content and _READERS.get(suffix) is not _READERS[by_content]:
        grid = _READERS[by_content](path, choice)
        note = note.format(f"file of the kind '{by_content}'")
        return replace(grid, notes=(note, *grid.notes))
    if suffix in _READERS and is_dicom(path, has_preamble=True):
        grid = read_dicom([path], path, choice)
        return replace(grid, notes=(note.format("DICOM file"), *grid.notes))
    if suffix in _READERS:
        return _READERS[suffix](path, choice)
    if suffix in dicom.SUFFIXES or is_dicom(path):
        return read_dicom(dicom_slices(path.parent), path, choice)
    raise unknown_kind(path)


def _kind_by_content(path: Path) -> str:
    """Return a file's usual suffix by its first bytes; empty if unknown."""
    with path.open("rb") as file:
        start = file.read(520)
    found = (suffixes for suffixes, begin, _ in _KINDS if re.match(begin, start, re.DOTALL))
    return next(found, "").partition(" ")[0]


def is_known(path: Path) -> bool:
    """Return True for a file of a supported kind, by its suffix or its content."""
    is_named = path.name.lower().endswith(SUFFIXES)
    return is_named or bool(_kind_by_content(path)) or is_dicom(path)


def unknown_kind(path: Path) -> VolumeError:
    """Return the error for a file of an unsupported kind."""
    if advice := foreign_advice(path):
        return VolumeError(f"{path}: {advice}.")
    return VolumeError(
        f"{path}: files of the kind '{suffix_of(path) or path.name}' are not read here; "
        "convert this one to NRRD, NIfTI or TIFF, or open plain numbers as a raw file."
    )


def _read_folder(folder: Path, choice: Choice) -> Grid:
    if is_zarr(folder):
        return read_zarr(folder, choice)
    if slices := dicom_slices(folder):
        return read_dicom(slices, None, choice)
    if slices := tiff_slices(folder):
        return read_tiff_folder(folder, slices, choice)
    if (first := folder_of_slices(folder)) and dicom_slices(first):
        return read_dicom(dicom_slices(folder, below=True), None, choice)
    if advice := folder_advice(folder, _READERS):
        raise VolumeError(f"{folder}: {advice}.")
    raise VolumeError(
        f"{folder}: the folder holds no DICOM or TIFF slices; "
        "choose a volume file or another folder."
    )
