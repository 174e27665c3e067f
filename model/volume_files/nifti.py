"""NIfTI-1 and -2, Analyze and MGH files: headers by nibabel, voxels as a block."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.volume import FileFacts, Label
from model.volume_files.arrays import rescaled
from model.volume_files.blocks import read_part, unpacked_start
from model.volume_files.checks import check_grid, damaged, errors_of, not_a, unsupported
from model.volume_files.choice import LARGEST, Choice, chosen
from model.volume_files.grid import Grid, placed, unit_name
from model.volume_files.label_names import LONGEST, snap_labels, workbench_labels

if TYPE_CHECKING:
    from nibabel.analyze import AnalyzeHeader

LONGEST_HEAD = 540
MGH_OFFSET = 284
LABELS = 1002  # NIfTI's code of the intent that values are labels
LEAST_OFFSETS = {"NIfTI-1": 352, "NIfTI-2": 544}

ALIKE = 1e-3  # relative difference of voxel sizes below which they count as equal


@dataclass(frozen=True, eq=False)
class _Head:
    """A header's facts on the voxels, fastest axis first; the offset is in the unpacked file."""

    format: str
    path: Path
    offset: int
    shape: tuple[int, ...]
    dtype: np.dtype[np.generic]
    slope: float
    intercept: float
    unit: str
    spacing: Sequence[float] | None
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    directions: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()
    is_labels: bool = False


def read_nifti(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a NIfTI, Analyze or MGH file in the order of its voxels."""
    with errors_of(path, "its header is invalid: {}", "nibabel.global", "nibabel"):
        head = _head(path)
    notes = head.notes
    shape = [*head.shape, 1, 1, 1][: max(len(head.shape), 3)]
    nx, ny, nz = (int(n) for n in shape[:3])
    times = int(shape[3]) if len(shape) > 3 else 1
    components = math.prod(int(n) for n in shape[4:])
    if nz == 1 and times > 1 and components == 1:
        nz, times = times, 1
        notes += ("The file calls its images time steps; they are taken for slices of a volume.",)
    values_each, dtype = _plain_type(path, head.dtype)
    check_grid(path, (nx, ny, nz), dtype, values_each * components * times)
    time, listed = chosen(path, "time", times, choice, (nx, ny, nz), dtype)
    volume = nx * ny * nz * values_each * dtype.itemsize
    # Complex numbers and colours have their values side by side, components do not.
    block = nz, ny, nx, values_each
    values: NDArray[np.generic] = np.empty((0,))
    for component in range(components):
        place = head.offset + (component * times + time) * volume
        part = read_part(head.path, block, dtype, place)
        if components == 1:
            values = part
            continue
        if not component:
            values = np.empty((*block[:3], components * values_each), part.dtype)
        values[..., component * values_each : (component + 1) * values_each] = part
    values = values if values.shape[3] > 1 else values[..., 0]
    if head.slope != 0 and np.isfinite([head.slope, head.intercept]).all():
        values = rescaled(values, head.slope, head.intercept)
    labels: tuple[Label, ...] = ()
    if head.is_labels:
        start = unpacked_start(head.path, min(head.offset, LONGEST))
        labels = workbench_labels(start) or snap_labels(path)
    steps = None if head.spacing is None else [abs(size) for size in head.spacing]
    said = head.is_labels
    facts = FileFacts(head.format, head.unit, contents=listed, is_labels=said, labels=labels)
    grid = Grid(values, origin=head.origin, notes=notes, facts=facts)
    return placed(grid, steps, head.directions, "RAS")


def _plain_type(path: Path, dtype: np.dtype[Any]) -> tuple[int, np.dtype[np.generic]]:
    """Return the number of values per voxel, and their type."""
    if dtype.fields:
        return len(dtype.fields), np.dtype(np.uint8)
    if dtype.kind == "c":
        return 2, np.dtype(f"{dtype.byteorder}f{dtype.itemsize // 2}")
    if dtype.kind not in "iuf" or dtype.itemsize > 8:
        raise unsupported(path, "voxels of such a data type", "convert them with nibabel")
    return 1, dtype


def _head(path: Path) -> _Head:
    """Read the header of a file, or of its pair."""
    suffix = path.name.lower()
    if suffix.endswith((".mgh", ".mgz")):
        return _mgh_head(path)
    header_file, voxel_file = _pair(path)
    start = unpacked_start(header_file, LONGEST_HEAD)
    header, form = _nifti_header(path, start)
    is_single = start[344:347] == b"n+1" or start[4:7] == b"n+2"
    offset = max(int(np.nan_to_num(float(header["vox_offset"]))), 0)
    if is_single:
        # Some writers omit it; voxels cannot begin within the header.
        offset = max(offset, LEAST_OFFSETS[form])
    try:
        dtype = header.get_data_dtype()
    except KeyError:
        how = f"its data type {int(header['datatype'])} is none of {form}'s"
        raise damaged(path, how) from None
    shape = tuple(int(n) for n in header.get_data_shape())
    place = header_file if is_single else voxel_file
    sizes = [float(size) for size in header["pixdim"][1:4]]
    spacing = sizes if any(sizes) else None
    if form == "Analyze":
        slope, notes = _analyze_scaling(header, header_file)
        return _Head(form, place, offset, shape, dtype, slope, 0.0, "", spacing, notes=notes)
    slope, intercept = float(header["scl_slope"]), float(header["scl_inter"])
    unit = unit_name(header.get_xyzt_units()[0].replace("unknown", ""))
    best, notes = _frame_of(header, sizes)
    origin, directions = (0.0, 0.0, 0.0), None
    if best is not None:
        directions, origin = best[:3, :3].T, tuple(best[:3, 3].tolist())
        spacing = np.linalg.norm(directions, axis=1).tolist()
    is_labels = int(header["intent_code"]) == LABELS
    return _Head(form, place, offset, shape, dtype, slope, intercept, unit, spacing, origin,
                 directions, notes, is_labels)  # fmt: skip


def _analyze_scaling(header: AnalyzeHeader, path: Path) -> tuple[float, tuple[str, ...]]:
    """Return the factor that SPM writes into an Analyze header, and notes."""
    notes: tuple[str, ...] = ()
    if path.name.lower().endswith((".nii", ".nii.gz")):
        notes += (
            "The header has no mark of NIfTI, so it is read as Analyze's, which says nothing "
            "of orientation.",
        )
    slope = float(np.frombuffer(header.binaryblock, f"{header.endianness}f4", 1, 112)[0])
    if not np.isfinite(slope) or slope in (0.0, 1.0):
        return 1.0, notes
    return slope, (*notes, f"The values are multiplied by SPM's factor {slope:g}.")


def _pair(path: Path) -> tuple[Path, Path]:
    """Return the files of header and voxels: one file, or .hdr and .img."""
    name = path.name.lower()
    if not name.endswith((".hdr", ".img", ".hdr.gz", ".img.gz")):
        # A file recognized by its content may have any name.
        return path, path
    stem = path.name[: name.rindex(".img" if ".img" in name else ".hdr")]
    siblings = {each.name.lower(): each for each in path.parent.glob(f"{escape(stem)}.*")}
    header = siblings.get(f"{stem.lower()}.hdr")
    voxels = siblings.get(f"{stem.lower()}.img") or siblings.get(f"{stem.lower()}.img.gz")
    if header is None or voxels is None:
        raise VolumeError(
            f"{path}: an Analyze or NIfTI pair needs the file {stem}{'.img' if header else '.hdr'} "
            "next to it; put it there, or open the file as raw if it is none."
        )
    for found in (header, voxels):
        if not found.resolve().is_relative_to(path.parent.resolve()):
            raise VolumeError(
                f"{found}: it is a link that leads out of its folder, from which nothing is "
                "read; put the file itself here."
            )
    return header, voxels


def _nifti_header(path: Path, start: bytes) -> tuple[Any, str]:
    """Return a checked header and the name of its format."""
    from nibabel.analyze import AnalyzeHeader
    from nibabel.nifti1 import Nifti1Header
    from nibabel.nifti2 import Nifti2Header

    is_second = start[4:8] in (b"n+2\0", b"ni2\0")
    is_first = start[344:348] in (b"n+1\0", b"ni1\0")
    kind: Any = Nifti2Header if is_second else Nifti1Header if is_first else AnalyzeHeader
    name, size = ("NIfTI-2", 540) if is_second else ("NIfTI-1" if is_first else "Analyze", 348)
    is_analyze = start[:4] in (b"\x5c\1\0\0", b"\0\0\1\x5c")
    if not (is_first or is_second or is_analyze) or len(start) < size:
        raise not_a(path, "a NIfTI file, or its header is truncated")
    header = kind(start[:size], check=False)
    if negative := [axis for axis, n in enumerate(header["dim"]) if n < 0]:
        raise damaged(path, f"its dimension {negative[0]} is negative")
    if not 1 <= int(header["dim"][0]) <= 7:
        raise damaged(path, f"it claims {int(header['dim'][0])} dimensions")
    return header, name


def _mgh_head(path: Path) -> _Head:
    from nibabel.freesurfer.mghformat import MGHHeader

    start = unpacked_start(path, MGH_OFFSET)
    if len(start) < MGH_OFFSET or start[:4] != b"\0\0\0\1":
        raise not_a(path, "an MGH file, or its header is truncated")
    header: Any = MGHHeader(start, check=False)  # type: ignore[no-untyped-call]
    shape = tuple(int(n) for n in header["dims"])
    if min(shape) < 1:
        raise damaged(path, f"it claims the dimensions {shape}")
    sizes = [float(size) for size in header["delta"]]
    dtype = header.get_data_dtype().newbyteorder(">")
    head = _Head("MGH", path, MGH_OFFSET, shape, dtype, 1.0, 0.0, "mm", sizes)
    if int(header["goodRASFlag"]) <= 0:
        return head
    matrix = header.get_affine()
    return replace(head, origin=matrix[:3, 3].tolist(), directions=matrix[:3, :3].T)


def _frame_of(
    header: Any, sizes: Sequence[float]
) -> tuple[NDArray[np.float64] | None, tuple[str, ...]]:
    """Return a header's sform, else its qform, and notes on contradictions."""
    sform, qform = _affine(header, "sform"), _affine(header, "qform")
    notes: tuple[str, ...] = ()
    if sform is None:
        if int(header["sform_code"]) > 0:
            notes = ("The file's sform is unusable; its qform or voxel sizes are used instead.",)
        return qform, notes
    lengths = np.linalg.norm(sform[:3, :3], axis=0)
    if not np.allclose(lengths, np.abs(sizes), rtol=ALIKE):
        notes += (
            f"The file's voxel sizes {_times(sizes)} differ from those of its sform, "
            f"{_times(lengths)}; the sform is used.",
        )
    return sform, notes if qform is None else notes + _differences(sform, qform)


def _affine(header: Any, name: str) -> NDArray[np.float64] | None:
    """Return one of the header's matrices, shape (4, 4); None if it is not set or unusable."""
    try:
        found = getattr(header, f"get_{name}")(coded=True)[0]
    except Exception:
        # Quaternions that are not a rotation.
        return None
    if found is None:
        return None
    matrix = np.array(found, np.float64)
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
        return None
    return matrix


def _differences(sform: NDArray[np.float64], qform: NDArray[np.float64]) -> tuple[str, ...]:
    """Describe how the two matrices disagree."""
    s, q = sform[:3, :3], qform[:3, :3]
    s_unit, q_unit = (each / np.linalg.norm(each, axis=0) for each in (s, q))
    if np.linalg.det(s) * np.linalg.det(q) < 0:
        what = "are mirror images of one another"
    elif not np.allclose(s_unit, q_unit, atol=1e-2):
        what = "turn the grid differently"
    elif not np.allclose(sform[:3, 3], qform[:3, 3], atol=float(np.abs(s).max())):
        what = "place the grid differently"
    else:
        return ()
    return (f"The file's sform and qform {what}; the sform is used.",)


def _times(sizes: Any) -> str:
    return " x ".join(f"{float(size):.4g}" for size in sizes)
