"""Blocks of voxels in a file: plain, or compressed with zlib, gzip or bzip2."""

from __future__ import annotations

import bz2
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from model.volume_files.checks import check_present, damaged, truncated

Encoding = Literal["raw", "deflate", "bzip2"]
"""Deflate stands for both zlib and gzip: the stream's first bytes tell them apart."""

CHUNK = 1 << 14
EITHER_ZLIB_OR_GZIP = 47


@dataclass(frozen=True)
class Block:
    """Where the voxels lie and how they are stored.

    Attributes
    ----------
    path : Path
    shape : tuple of int
        Slowest axis first.
    dtype : numpy.dtype
        With the byte order of the file.
    offset : int
        First byte; -1 when the block is the end of the file.
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
    size = block.path.stat().st_size
    offset = size - block.nbytes if block.offset < 0 else block.offset
    if block.encoding == "raw":
        check_present(block.path, size - max(offset, 0) if offset >= 0 else size, block.nbytes)
    voxels = np.empty(block.shape, block.dtype)
    with block.path.open("rb") as file:
        file.seek(offset)
        target = voxels.reshape(-1).view(np.uint8).data
        if block.encoding == "raw":
            check_present(block.path, _fill(target, iter(lambda: file.read(1 << 24), b"")), len(target))
        else:
            _inflate_into(target, file, block)
    if voxels.dtype.isnative:
        return voxels
    return voxels.byteswap(inplace=True).view(voxels.dtype.newbyteorder("="))
