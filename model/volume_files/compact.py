"""Compact volumes (.tfvolume): voxels in a given number of bytes, with all that a volume has.

A ZIP archive, which every system's tools open: ``volume.json`` says what the volume is, where it
comes from, how it is shown at first, and how far its images are from the original's; ``voxels``
holds the voxels (:mod:`model.volume_files.voxel_code`), ``missing`` a bit for each of them where
some are missing. Nothing is decoded whose checksum is not that of the head.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from model.errors import TransferFunctionError, ViewError, first_line
from model.files import writing
from model.json_files import MalformedError, build, parse_json
from model.scene.axes import AXES
from model.scene.file_facts import FileFacts
from model.scene.transfer_function import TransferFunction
from model.scene.view import View
from model.scene.volume import Triple, Volume
from model.volume_files.checks import check_grid, damaged, unsupported
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.grid import Grid
from model.volume_files.voxel_code import (
    GREATEST_RATIO,
    LEAST_BITS,
    CodedVoxels,
    Ends,
    Method,
    decode_voxels,
)

SUFFIX = ".tfvolume"
VERSION = 1
HEAD, VOXELS, MISSING = "volume.json", "voxels", "missing"
LONGEST_HEAD = 1 << 20

Count = Annotated[int, Meta(ge=2, le=1 << 20)]


@dataclass(frozen=True)
class ImageError:
    """How far images of a compact volume are from those of the volume itself.

    Attributes
    ----------
    rmse : float
        Mean over images of random views and TFs, of colours in [0, 1], unlit.
    largest : float
        That of the worst of them.
    """

    rmse: float
    largest: float
    images: int


@dataclass(frozen=True)
class Provenance:
    """Where a compact volume comes from.

    Attributes
    ----------
    name : str
        File or folder name of the original.
    nbytes : int
        Of its voxels, uncompressed.
    fingerprint : str
        :attr:`model.scene.volume.Volume.fingerprint` of the original.
    error : ImageError or None
        None of a volume without loss.
    """

    name: str
    format: str
    nbytes: int
    fingerprint: str
    error: ImageError | None = None


@dataclass(frozen=True)
class _Head:
    """What ``volume.json`` holds."""

    tfscope_volume: int
    dimensions: tuple[Count, Count, Count]
    type: str
    method: Method
    ends: Ends
    sha256: str
    missing_sha256: str
    spacing: Triple
    origin: Triple
    units: str
    axis_labels: tuple[str, ...]
    spacing_unit: str
    directions: tuple[Triple, ...]
    space: str
    notes: tuple[str, ...]
    original: Provenance
    tf: dict[str, Any] | None = None
    view: View | None = None
    up: str = ""


def write_compact(
    path: Path,
    volume: Volume,
    coded: CodedVoxels,
    error: ImageError | None = None,
    tf: TransferFunction | None = None,
    view: View | None = None,
    up: str = "",
) -> None:
    """Write a volume in compact form.

    Parameters
    ----------
    volume : Volume
        As it was read; its values are written, whatever scale it is on.
    coded : CodedVoxels
        Of the volume's voxels.
    error : ImageError or None
        What was measured of them; None where nothing is lost.
    tf, view
        To show the volume through and from at first; None leaves them to who opens it.
    up : str
        Axis that points up, such as "+z", where the volume does not say it.

    Raises
    ------
    OSError
        When the file cannot be written.
    """
    volume = volume.linear
    voxels = volume.voxels
    missing = b""
    if volume.missing is not None:
        missing = zlib.compress(np.packbits(volume.missing).tobytes(), 6)
    head = _Head(
        VERSION,
        volume.dimensions,
        voxels.dtype.name,
        coded.method,
        Ends.of(voxels, volume.missing),
        hashlib.sha256(coded.data).hexdigest(),
        hashlib.sha256(missing).hexdigest(),
        volume.spacing,
        volume.origin,
        volume.units,
        volume.axis_labels,
        volume.file.spacing_unit,
        volume.file.directions,
        volume.file.space,
        volume.notes,
        Provenance(volume.name, volume.file.format, voxels.nbytes, volume.fingerprint, error),
        None if tf is None else tf.to_json(),
        view,
        up or volume.up,
    )
    with writing(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr(HEAD, json.dumps(asdict(head), indent=1))
        archive.writestr(VOXELS, coded.data)
        if missing:
            archive.writestr(MISSING, missing)


def read_compact(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a compact volume.

    Raises
    ------
    VolumeError
        When the file is foreign, damaged or of a later version.
    """
    del choice
    try:
        with zipfile.ZipFile(path) as archive:
            head = _read_head(path, archive)
            dtype = np.dtype(head.type)
            check_grid(path, head.dimensions, dtype)
            data = _member(path, archive, VOXELS, head.sha256)
            count = int(np.prod(head.dimensions, dtype=object))
            if head.method == "sperr" and 8 * len(data) < 0.5 * LEAST_BITS * count:
                raise damaged(path, "its voxels are too few bytes for its dimensions")
            packed = _member(path, archive, MISSING, head.missing_sha256)
            tf = None if head.tf is None else TransferFunction.from_json(head.tf)
    except TransferFunctionError as error:
        raise damaged(path, f"its TF is malformed: {error}") from None
    except (zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError) as error:
        raise damaged(path, f"as a ZIP archive: {first_line(error)}") from None
    shape = head.dimensions[::-1]
    try:
        coded = CodedVoxels(head.method, data)
        voxels = decode_voxels(coded, shape, dtype, head.ends)
        missing = _unpacked(packed, shape) if packed else None
    except (ValueError, zlib.error) as error:
        raise damaged(path, first_line(error)) from None
    return Grid(
        voxels,
        head.spacing,
        head.origin,
        head.units,
        (_note(head, path.stat().st_size), *head.notes),
        head.axis_labels,
        missing,
        FileFacts(
            "tfscope compact volume",
            head.spacing_unit,
            head.directions,
            head.space,
            tf=tf,
            view=head.view,
            up=head.up,
            is_lossy=not coded.is_exact,
            image_error=None if head.original.error is None else head.original.error.rmse,
        ),
    )


def _read_head(path: Path, archive: zipfile.ZipFile) -> _Head:
    try:
        with archive.open(HEAD) as file:
            data: Any = parse_json(file.read(LONGEST_HEAD))
        version = data.get("tfscope_volume") if isinstance(data, dict) else None
        if isinstance(version, int) and version > VERSION:
            raise unsupported(path, f"a compact volume of version {version}", "update tfscope")
        head = build(_Head, data)
        dtype = np.dtype(head.type)
    except KeyError:
        raise damaged(path, f"it has no '{HEAD}'") from None
    except (MalformedError, TypeError, ViewError) as error:
        raise damaged(path, f"its '{HEAD}' is malformed: {first_line(error)}") from None
    count = int(np.prod(head.dimensions, dtype=object))
    in_type = dtype.kind in "iuf" and _holds(dtype, head.ends.values)
    in_grid = all(0 <= place < count for place in head.ends.places)
    if not (in_type and in_grid) or head.up not in ("", *AXES):
        raise damaged(path, f"its '{HEAD}' contradicts itself")
    return head


def _holds(dtype: np.dtype[Any], ends: tuple[float, float]) -> bool:
    low, high = ends
    limits = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(str(dtype))
    return bool(limits.min <= low < high <= limits.max)


def _member(path: Path, archive: zipfile.ZipFile, name: str, sha256: str) -> bytes:
    """Read a member whole, and check it; what is stored cannot be longer than the file."""
    try:
        info = archive.getinfo(name)
    except KeyError:
        data = b""
    else:
        if info.compress_type != zipfile.ZIP_STORED:
            raise damaged(path, f"its '{name}' is compressed twice")
        data = archive.read(name)
    if hashlib.sha256(data).hexdigest() != sha256:
        raise damaged(path, f"its '{name}' is not what was written")
    return data


def _unpacked(packed: bytes, shape: tuple[int, int, int]) -> NDArray[np.bool_]:
    count = int(np.prod(shape, dtype=object))
    if count > 8 * GREATEST_RATIO * len(packed):
        raise ValueError("its mask is too short")
    bits = np.frombuffer(zlib.decompressobj().decompress(packed, -(-count // 8)), np.uint8)
    return np.unpackbits(bits, count=count).astype(bool).reshape(shape)


def _note(head: _Head, size: int) -> str:
    original = head.original
    share = f"{100 * size / original.nbytes:.2g} % of its {original.nbytes / 1e6:.3g} MB"
    error = original.error
    if error is None:
        return f"A compact copy of {original.name} without loss: {size / 1e6:.3g} MB, {share}."
    return (
        f"A compact copy of {original.name}: {size / 1e6:.3g} MB, {share}; image error "
        f"{error.rmse:.2g}, largest {error.largest:.2g}, over {error.images} random views and TFs."
    )
