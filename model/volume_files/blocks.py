"""Blocks of voxels in a file: plain, or compressed with zlib, gzip or bzip2."""

from __future__ import annotations

import bz2
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from model.volume_files.checks import check_present, damaged, truncated

Encoding = Literal["raw", "deflate", "bzip2"]
"""Deflate stands for both zlib and gzip, which differ in the stream's first bytes."""

CHUNK = 1 << 14
EITHER_ZLIB_OR_GZIP = 47


@dataclass(frozen=True)
class Block:
    """Location and encoding of the voxels in a file.

    Attributes
    ----------
    path : Path
    shape : tuple of int
        Slowest axis first.
    dtype : numpy.dtype
        With the byte order of the file.
    offset : int
        First byte; -1 for a block at the end of the file.
    encoding : {"raw", "deflate", "bzip2"}
    """

    path: Path
    shape: tuple[int, ...]
    dtype: np.dtype[np.generic]
    offset: int = 0
    encoding: Encoding = "raw"

    @property
    def nbytes(self) -> int:
        """Bytes of the voxels, uncompressed."""
        return math.prod(self.shape) * self.dtype.itemsize


def read_block(block: Block) -> NDArray[np.generic]:
    """Read a block's voxels in native byte order.

    Returns
    -------
    ndarray
        Of the block's shape, C-contiguous.

    Raises
    ------
    VolumeError
        When the file ends too early or a compressed stream is damaged.
    """
    voxels = np.empty(block.shape, block.dtype)
    target = voxels.reshape(-1).view(np.uint8)
    with block.path.open("rb") as file:
        if block.offset < 0:
            file.seek(max(block.path.stat().st_size - block.nbytes, 0))
        else:
            file.seek(block.offset)
        if block.encoding == "raw":
            check_present(block.path, file.readinto(target.data), block.nbytes)
        else:
            _inflate(file, block, target)
    if voxels.dtype.isnative:
        return voxels
    return voxels.byteswap(inplace=True).view(voxels.dtype.newbyteorder("="))


def _inflate(file: BinaryIO, block: Block, target: NDArray[np.uint8]) -> None:
    """Decompress the rest of a file into `target`, which it must fill exactly."""
    done = 0
    try:
        for piece in _pieces(file, block.encoding):
            if done + len(piece) > len(target):
                raise damaged(block.path, "it holds more voxels than its header says")
            target[done : done + len(piece)] = np.frombuffer(piece, np.uint8)
            done += len(piece)
    except EOFError:
        raise truncated(block.path, "its compressed stream stops before the end") from None
    except (zlib.error, OSError, ValueError) as error:
        raise damaged(block.path, f"its compressed stream is invalid ({error})") from None
    check_present(block.path, done, len(target))


def _pieces(file: BinaryIO, encoding: Encoding) -> Iterator[bytes]:
    """Yield the data of one or more consecutive streams; raise EOFError if one is cut off."""

    def fresh() -> Any:
        if encoding == "bzip2":
            return bz2.BZ2Decompressor()
        return zlib.decompressobj(wbits=EITHER_ZLIB_OR_GZIP)

    decoder = fresh()
    while data := file.read(CHUNK):
        while data:
            yield decoder.decompress(data)
            data = decoder.unused_data if decoder.eof else b""
            if data:
                decoder = fresh()
    if not decoder.eof:
        raise EOFError
