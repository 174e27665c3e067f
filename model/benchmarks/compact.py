"""What the bytes of a compact volume are worth, beside other compressors at as many bytes."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.evaluation.compact_error import TrueImages
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.compact import write_compact
from model.volume_files.voxel_code import Ends, encode_voxels

SEARCHES = 12
"""Error bounds that are tried for a compressor that takes a bound, not a size."""

Array = NDArray[np.float32]


@dataclass(frozen=True)
class CompactRow:
    """A compressor at one size.

    Attributes
    ----------
    bytes_a_voxel : float
        Of the file, or of the rival's code.
    rmse, largest : float
        Image errors, see :class:`model.volume_files.compact.ImageError`.
    write_seconds, read_seconds : float
        From voxels to the file and back; of a rival, of its code.
    """

    name: str
    bytes_a_voxel: float
    rmse: float
    largest: float
    write_seconds: float
    read_seconds: float


def compare_compressors(
    volume: Volume, rates: Sequence[float], images: int, rivals: bool
) -> Iterator[CompactRow]:
    """Compress a volume to some sizes, and measure images of what comes back.

    Parameters
    ----------
    rates : sequence of float
        Sizes in bytes a voxel.
    images : int
        Random views and TFs.
    rivals : bool
        Whether ZFP and SZ3 are measured, too.

    Yields
    ------
    CompactRow
        For each size: the compact volume, then its rivals at nearly as many bytes.
    """
    truth = TrueImages(volume)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.tfvolume"
        for rate in rates:
            begun = time.perf_counter()
            coded = encode_voxels(volume.voxels, int(rate * volume.voxels.size), volume.missing)
            write_compact(path, volume, coded)
            written = time.perf_counter()
            copy = read_volume(path)
            read = time.perf_counter()
            name = "without loss" if coded.is_exact else "compact volume"
            size = path.stat().st_size / volume.voxels.size
            error = truth.error_of(copy, images)
            yield CompactRow(name, size, error.rmse, error.largest, written - begun, read - written)
            for rival in _RIVALS if rivals else ():
                yield _rival(volume, truth, rival, size, images)


def _rival(volume: Volume, truth: TrueImages, name: str, rate: float, images: int) -> CompactRow:
    """Measure a rival at the loosest error bound that takes at most so many bytes a voxel."""
    encode, decode = _RIVALS[name]()
    voxels = volume.voxels
    lo, hi = volume.data_range
    levels = ((voxels.astype(np.float64) - lo) / (hi - lo) * 255).astype(np.float32)
    few, many = math.log(1e-4), math.log(300.0)
    for _ in range(SEARCHES):
        bound = (few + many) / 2
        is_small = len(encode(levels, math.exp(bound))) <= rate * voxels.size
        few, many = (few, bound) if is_small else (bound, many)
    begun = time.perf_counter()
    code = encode(levels, math.exp(many))
    coded = time.perf_counter()
    decoded = decode(code, levels)
    end = time.perf_counter()
    values = np.clip(decoded.astype(np.float64) / 255 * (hi - lo) + lo, lo, hi)
    values = np.rint(values) if voxels.dtype.kind != "f" else values
    values = values.astype(voxels.dtype)
    # As the compact volume has them, so that both are drawn over the same range.
    Ends.of(voxels, volume.missing).put_into(values)
    error = truth.error_of(replace(volume, voxels=values), images)
    size = len(code) / voxels.size
    return CompactRow(name, size, error.rmse, error.largest, coded - begun, end - coded)


Codec = tuple[Callable[[Array, float], bytes], Callable[[bytes, Array], NDArray[Any]]]


def _zfp() -> Codec:
    import imagecodecs

    def encode(levels: Array, bound: float) -> bytes:
        mode: Any = imagecodecs.ZFP.MODE.FIXED_ACCURACY
        tolerance: Any = bound
        return bytes(imagecodecs.zfp_encode(levels, tolerance, mode=mode))

    return encode, lambda code, levels: np.asarray(imagecodecs.zfp_decode(code))


def _sz3() -> Codec:
    import imagecodecs

    def encode(levels: Array, bound: float) -> bytes:
        return bytes(imagecodecs.sz3_encode(levels, mode=imagecodecs.SZ3.MODE.ABS, abs=bound))

    def decode(code: bytes, levels: Array) -> NDArray[Any]:
        return np.asarray(imagecodecs.sz3_decode(code, levels.shape, levels.dtype))

    return encode, decode


_RIVALS: dict[str, Callable[[], Codec]] = {"ZFP": _zfp, "SZ3": _sz3}
