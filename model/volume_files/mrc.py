"""MRC and CCP4 maps, as from electron microscopy: headers by mrcfile, voxels as a block."""

import math
from pathlib import Path
from typing import Literal

import numpy as np

from model.errors import first_line
from model.scene.volume import FileFacts
from model.volume_files.blocks import read_part, unpacked_start
from model.volume_files.checks import check_grid, damaged, log_of, not_a, unsupported
from model.volume_files.choice import LARGEST, Choice, chosen
from model.volume_files.grid import Grid, placed

HEAD = 1024
VOLUME_STACKS = range(401, 631)
IMOD_STAMP = 1146047817


def read_mrc(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read an MRC file; of a stack of volumes one."""
    start = unpacked_start(path, HEAD)
    header, order = _header(path, start)
    nx, ny, nz = (int(header[name]) for name in ("nx", "ny", "nz"))
    mode = int(header["mode"])
    values_each, dtype = _type(path, header, mode)
    is_stack = int(header["ispg"]) in VOLUME_STACKS and 0 < int(header["mz"]) < nz
    count = nz // int(header["mz"]) if is_stack else 1
    nz //= count
    check_grid(path, (nx, ny, nz), dtype, values_each * count)
    number, listed = chosen(path, "series", count, choice, (nx, ny, nz), dtype)
    shape = (nz, ny, nx, values_each) if values_each > 1 else (nz, ny, nx)
    place = HEAD + max(int(header["nsymbt"]), 0) + number * math.prod(shape) * dtype.itemsize
    values = read_part(path, shape, dtype.newbyteorder(order), place)
    if dtype == np.float16:
        values = values.astype(np.float32)
    axes = [int(header[name]) for name in ("mapc", "mapr", "maps")]
    axes = axes if any(axes) else [1, 2, 3]
    if sorted(axes) != [1, 2, 3]:
        raise damaged(path, f"its axes are {axes}, not 1, 2 and 3 in some order")
    x, y, z = places = [axes.index(k) for k in (1, 2, 3)]
    # The file's axis k, fastest first, is the array's axis 2 - k.
    values = np.transpose(values, [2 - z, 2 - y, 2 - x, *range(3, values.ndim)])
    spacing, origin, unit, notes = _frame(header, places)
    if int(header["ispg"]) == 0 and nz > 1:
        notes += ("The file says that it is a stack of images, not a volume.",)
    facts = FileFacts("MRC", unit, contents=listed)
    return placed(Grid(values, origin=origin, notes=notes, facts=facts), spacing)


def _header(path: Path, start: bytes) -> tuple[np.ndarray, Literal["<", ">"]]:
    """Return the header, and the byte order of the file."""
    from mrcfile.dtypes import HEADER_DTYPE

    foreign = not_a(path, "an MRC file, or its header is truncated")
    if len(start) < HEAD:
        raise foreign
    orders: tuple[Literal["<", ">"], ...] = ("<", ">")
    for order in orders:
        header = np.frombuffer(start[:HEAD], HEADER_DTYPE.newbyteorder(order))[0]
        axes = sorted(int(header[name]) for name in ("mapc", "mapr", "maps"))
        sizes = [int(header[name]) for name in ("nx", "ny", "nz")]
        is_map = bytes(header["map"]) in (b"MAP ", b"MAP\0")
        is_plausible = 0 <= int(header["mode"]) <= 200 and all(0 < n < 1 << 20 for n in sizes)
        if is_plausible and (is_map or axes in ([1, 2, 3], [0, 0, 0])):
            return header, order
    if start[208:211] == b"MAP":
        raise damaged(path, "its header gives sizes or a mode that cannot be")
    raise foreign


def _type(path: Path, header: np.ndarray, mode: int) -> tuple[int, np.dtype[np.generic]]:
    """Return the number of values of each voxel, and their type."""
    from mrcfile.utils import dtype_from_mode

    if mode == 0:
        words = np.frombuffer(header.tobytes(), np.dtype(np.int32).newbyteorder("<"))
        # IMOD's stamp and its flag for signed bytes; else extremes that no signed byte has.
        is_stamped = words[38] == IMOD_STAMP
        is_wide = 0 <= float(header["dmin"]) <= 127 < float(header["dmax"]) <= 255
        if not words[39] & 1 if is_stamped else is_wide:
            return 1, np.dtype(np.uint8)
    try:
        with log_of("mrcfile"):
            dtype = np.dtype(dtype_from_mode(mode))
    except Exception as error:
        what = f"an MRC file of mode {mode} ({first_line(error)})"
        raise unsupported(path, what, "convert it with newstack") from None
    if dtype.kind == "c":
        return 2, np.dtype(np.float32)
    return 1, dtype


def _frame(
    header: np.ndarray, places: list[int]
) -> tuple[list[float | None] | None, list[float], str, tuple[str, ...]]:
    """Return spacing, origin and unit, and notes."""
    lengths = [float(header["cella"][name]) for name in "xyz"]
    counts = [int(header[name]) for name in ("mx", "my", "mz")]
    sizes: list[float | None] = [
        length / count if count > 0 and length > 0 and np.isfinite(length) else None
        for length, count in zip(lengths, counts, strict=True)
    ]
    starts = [int(header[name]) for name in ("nxstart", "nystart", "nzstart")]
    origin = [float(header["origin"][name]) for name in "xyz"]
    if not any(origin):
        origin = [starts[k] * (size or 1.0) for k, size in zip(places, sizes, strict=True)]
    notes: tuple[str, ...] = ()
    angles = [float(header["cellb"][name]) for name in ("alpha", "beta", "gamma")]
    if any(abs(angle - 90) > 0.1 for angle in angles if angle):
        notes = (
            "The cell's angles are not right ones ({:g}, {:g}, {:g}); the grid is shown as if they "
            "were.".format(*angles),
        )
    known = any(size is not None for size in sizes)
    return (sizes if known else None), origin, "angstrom" if known else "", notes
