"""Compressed voxels: without loss where that is small enough, else by a wavelet code (SPERR)."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.missing_voxels import filled

Method = Literal["deflate", "sperr"]
"""Differences along x, their bytes apart, by DEFLATE; or a wavelet code cut off at a length."""

CHUNK, LEAST_CHUNK = 256, 32
"""Largest and least edge, in voxels, of the blocks that are coded by themselves; two of them along
z are work for two threads."""

LEVELS = 255.0
"""Extent that values are scaled to before they are coded."""

LEAST_BITS = 0.02
"""Fewest bits a voxel that are coded with loss: nothing much is left of a volume by then."""

GREATEST_RATIO = 1100
"""Largest ratio of bytes to those of DEFLATE, with some room."""

LIKELY = 1.25
"""Size of a sample without loss, as a multiple of what is wanted, up to which all is tried."""

SAMPLED = 8
"""One slice of so many is compressed to see whether all of them may be small enough."""


@dataclass(frozen=True)
class CodedVoxels:
    """Voxels in compressed form.

    Attributes
    ----------
    method : {"deflate", "sperr"}
    """

    method: Method
    data: bytes

    @property
    def is_exact(self) -> bool:
        """Whether nothing is lost."""
        return self.method == "deflate"


@dataclass(frozen=True)
class Ends:
    """Smallest and largest voxel, which are kept exactly, so that the range is.

    Attributes
    ----------
    places : tuple of int
        Where in the array, counted with x fastest, the first of each is.
    """

    values: tuple[float, float]
    places: tuple[int, int]

    @classmethod
    def of(cls, voxels: NDArray[Any], missing: NDArray[np.bool_] | None = None) -> Ends:
        """Find the ends of voxels (nz, ny, nx) that are not missing."""
        flat = voxels.reshape(-1)
        if missing is None:
            places = int(flat.argmin()), int(flat.argmax())
        else:
            present = np.flatnonzero(~missing)
            measured = flat[present]
            places = int(present[measured.argmin()]), int(present[measured.argmax()])
        low, high = (float(flat[place]) for place in places)
        return cls((low, high), places)

    def put_into(self, voxels: NDArray[Any]) -> None:
        """Give the voxels at these places these values."""
        for place, value in zip(self.places, self.values, strict=True):
            voxels.flat[place] = value


def encode_voxels(
    voxels: NDArray[Any], most_bytes: int, missing: NDArray[np.bool_] | None = None
) -> CodedVoxels:
    """Compress voxels to about so many bytes; without loss where that takes no more.

    Parameters
    ----------
    voxels : ndarray, shape (nz, ny, nx)
        Finite integers or floating-point numbers, not all equal.
    missing : ndarray of bool, shape (nz, ny, nx), optional
        Voxels whose numbers mean nothing; with loss, others take their place.

    Raises
    ------
    VolumeError
        When so few bytes leave nothing of the volume.
    """
    exact = _deflated(voxels[::SAMPLED], 1)
    if len(exact) * (voxels.shape[0] / len(voxels[::SAMPLED])) <= LIKELY * most_bytes:
        whole = _deflated(voxels, 6)
        if len(whole) <= most_bytes:
            return CodedVoxels("deflate", whole)
    bits = 8 * most_bytes / voxels.size
    if bits < LEAST_BITS:
        least = LEAST_BITS / 8 * voxels.size / 1e6
        raise VolumeError(
            f"{most_bytes / 1e6:.3g} MB leave nothing of so many voxels; give at least "
            f"{least:.2g} MB."
        )
    low, high = Ends.of(voxels, missing).values
    if missing is not None:
        # A file's 1e30 where nothing was measured would leave nothing of what was.
        voxels = filled(voxels, missing, low)
    step = (high - low) / LEVELS
    levels = np.subtract(voxels, low, dtype=_precise(voxels.dtype))
    levels /= step
    # Late: with it come the codecs of all image formats.
    import imagecodecs

    nz, ny, nx = voxels.shape
    chunks = min(CHUNK, nz, max(LEAST_CHUNK, -(-nz // 2))), min(CHUNK, ny), min(CHUNK, nx)
    data = imagecodecs.sperr_encode(
        levels.astype(np.float32, copy=False),
        min(bits, 32.0),
        imagecodecs.SPERR.MODE.BPP,
        chunks=chunks,
        numthreads=0,
    )
    return CodedVoxels("sperr", bytes(data))


def decode_voxels(
    coded: CodedVoxels, shape: tuple[int, int, int], dtype: np.dtype[Any], ends: Ends
) -> NDArray[Any]:
    """Return voxels of their own type, within the range that they were in.

    The data must be those that were written, which a checksum tells: damaged ones of the
    wavelet code may end the process.

    Parameters
    ----------
    shape : tuple of int
        Lengths along z, y and x.
    dtype : numpy.dtype

    Raises
    ------
    ValueError
        When the data are not those of so many voxels.
    """
    if coded.method == "deflate":
        return _inflated(coded.data, shape, dtype)
    if _coded_shape(coded.data) != shape:
        raise ValueError("its code is of other dimensions")
    import imagecodecs

    levels = np.asarray(imagecodecs.sperr_decode(coded.data, numthreads=0))
    low, high = ends.values
    step = (high - low) / LEVELS
    values = np.multiply(levels.reshape(shape), step, dtype=_precise(dtype))
    values += low
    np.clip(values, low, high, out=values)
    if dtype.kind != "f":
        np.rint(values, out=values)
    voxels = values.astype(dtype)
    ends.put_into(voxels)
    return voxels


def _precise(dtype: np.dtype[Any]) -> type[np.float32 | np.float64]:
    """Type that values can be computed with as precisely as they are."""
    is_short = dtype == np.float32 or dtype.itemsize <= 2
    return np.float32 if is_short else np.float64


def _coded_shape(data: bytes) -> tuple[int, int, int] | None:
    """Lengths along z, y and x that the head of a wavelet code tells; None if it has none."""
    if len(data) < 14:
        return None
    nx, ny, nz = struct.unpack_from("<3I", data, 2)
    return nz, ny, nx


def _deflated(voxels: NDArray[Any], level: int) -> bytes:
    """Differences along x of the voxels' bits, bytes of the same place together, by DEFLATE."""
    bits = np.ascontiguousarray(voxels).view(f"u{voxels.dtype.itemsize}")
    differences = bits.copy()
    differences[..., 1:] -= bits[..., :-1]
    planes = differences.astype(differences.dtype.newbyteorder("<")).view(np.uint8)
    planes = planes.reshape(-1, voxels.dtype.itemsize).T
    return zlib.compress(np.ascontiguousarray(planes).tobytes(), level)


def _inflated(data: bytes, shape: tuple[int, int, int], dtype: np.dtype[Any]) -> NDArray[Any]:
    count = int(np.prod(shape, dtype=object)) * dtype.itemsize
    if count > GREATEST_RATIO * len(data):
        raise ValueError("its code is too short")
    inflater = zlib.decompressobj()
    content = inflater.decompress(data, count)
    if len(content) != count or inflater.decompress(inflater.unconsumed_tail, 1):
        raise ValueError("its code has another length")
    planes = np.frombuffer(content, np.uint8).reshape(dtype.itemsize, -1)
    bits = np.ascontiguousarray(planes.T).view(f"<u{dtype.itemsize}").reshape(shape)
    unsigned = np.dtype(f"u{dtype.itemsize}")
    summed = np.cumsum(bits.astype(unsigned, copy=False), axis=-1, dtype=unsigned)
    return summed.view(dtype)
