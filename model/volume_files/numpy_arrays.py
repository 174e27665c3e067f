"""Arrays saved by NumPy: .npy and .npz."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from model.errors import VolumeError, first_line
from model.volume_files.arrays import StoredArray, grid_of_arrays
from model.volume_files.checks import check_grid, check_present, damaged, truncated, unsupported
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.grid import Grid

SUFFIXES = (".npy", ".npz")


def read_numpy(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read an array saved by NumPy, its last axis being x."""
    try:
        if path.suffix.lower() == ".npy":
            return grid_of_arrays(path, [_mapped(path)], choice, "NumPy array")
        with zipfile.ZipFile(path) as archive:
            members = [info for info in archive.infolist() if info.filename.endswith(".npy")]
            arrays = [_member(path, archive, info) for info in members]
            return grid_of_arrays(path, arrays, choice, "NumPy archive")
    except (OSError, MemoryError, VolumeError):
        raise
    except (zipfile.BadZipFile, zlib.error) as error:
        with path.open("rb") as file:
            is_archive = file.read(4) == b"PK\x03\x04"
        if is_archive and not zipfile.is_zipfile(path):
            raise truncated(path, "it lacks the list of its arrays, which is at the end") from None
        raise damaged(path, first_line(error)) from None
    except ValueError as error:
        if "magic string" in str(error):
            raise VolumeError(
                f"{path}: this is not an array saved by NumPy; choose another or correct its "
                "suffix."
            ) from None
        raise damaged(path, f"NumPy says '{first_line(error)}'") from None
    except Exception as error:
        raise damaged(path, f"NumPy says '{first_line(error)}'") from None


def _head(path: Path, file: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Read the head of an array; the file is then at its first value."""
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(file)
    else:
        shape, is_fortran, dtype = np.lib.format.read_array_header_2_0(file)
    if dtype.hasobject:
        raise unsupported(path, "a NumPy array of Python objects", "save its numbers alone")
    return tuple(int(n) for n in shape), is_fortran, dtype


def _mapped(path: Path) -> StoredArray:
    with path.open("rb") as file:
        shape, is_fortran, dtype = _head(path, file)
        offset = file.tell()
    need = int(np.prod(shape, dtype=object)) * dtype.itemsize
    check_present(path, path.stat().st_size - offset, need)

    def read(index: Any) -> np.ndarray[Any, Any]:
        order = "F" if is_fortran else "C"
        return np.array(np.memmap(path, dtype, "r", offset, shape, order)[index])  # type: ignore[call-overload]

    return StoredArray(path.stem, shape, dtype, read)


def _member(path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> StoredArray:
    with archive.open(info) as file:
        shape, is_fortran, dtype = _head(path, file)  # type: ignore[arg-type]

    def read(index: Any) -> np.ndarray[Any, Any]:
        check_grid(path, (*shape[::-1], 2, 2)[:3], np.dtype(np.uint8))
        need = int(np.prod(shape, dtype=object)) * dtype.itemsize
        check_present(path, info.file_size, need)
        flat = np.empty(need, np.uint8)
        with archive.open(info) as file:
            _head(path, file)  # type: ignore[arg-type]
            done = 0
            while done < need:
                count = file.readinto(flat[done : done + (1 << 24)].data)  # type: ignore[attr-defined]
                if not count:
                    break
                done += count
        check_present(path, done, need)
        array = flat.view(dtype).reshape(shape, order="F" if is_fortran else "C")
        return array[index]

    return StoredArray(info.filename.removesuffix(".npy"), shape, dtype, read)
