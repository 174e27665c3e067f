"""Reading voxels: blocks, plain or compressed by zlib, gzip or bzip2, and progress by slices."""

import bz2
import gzip
import math
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.threads import in_threads
from model.volume_files.checks import check_present, damaged, truncated

Encoding = Literal["raw", "deflate", "bzip2"]  # deflate stands for zlib and gzip

CHUNK, PIECE = 1 << 14, 1 << 24  # bytes of a file, packed and not, that are read at once
EITHER_ZLIB_OR_GZIP = 47
LONGEST_REST = 1 << 20  # bytes after the voxels that are unpacked to check the stream


@dataclass(frozen=True)
class Block:
    """Location and encoding of the voxels in a file, slowest axis first.

    The offset is -1 for a block at the end of the file. `skip` counts unpacked bytes before the
    voxels; `more` says whether something may follow them.
    """

    path: Path
    shape: tuple[int, ...]
    dtype: np.dtype[np.generic]
    offset: int = 0
    encoding: Encoding = "raw"
    skip: int = 0
    more: bool = False

    @property
    def nbytes(self) -> int:
        """Bytes of the voxels, uncompressed."""
        return math.prod(self.shape) * self.dtype.itemsize


def part_of(block: Block, number: int) -> Block:
    """Return one entry of a block's slowest axis, such as a time step."""
    count, *shape = block.shape
    part = replace(block, shape=tuple(shape))
    before = number * part.nbytes
    if block.encoding != "raw":
        return replace(part, skip=block.skip + before, more=block.more or number < count - 1)
    offset = block.offset
    if offset < 0:
        offset = max(block.path.stat().st_size - block.nbytes, 0)
    return replace(part, offset=offset + before)


def read_block(block: Block) -> NDArray[np.generic]:
    """Read a block's voxels in native byte order, C-contiguous."""
    voxels = np.empty(block.shape, block.dtype)
    target = voxels.reshape(-1).view(np.uint8)
    start = block.offset
    if start < 0:
        start = max(block.path.stat().st_size - block.nbytes, 0)

    def read(place: int) -> int:
        with block.path.open("rb") as file:
            file.seek(start + place)
            return file.readinto(target[place : place + PIECE].data)

    if block.encoding == "raw":
        # Threads, as memory is slow when it is written for the first time.
        found = in_threads(read, range(0, block.nbytes, PIECE))
        check_present(block.path, sum(found), block.nbytes)
    else:
        with block.path.open("rb") as file:
            file.seek(start)
            _inflate(file, block, target)
    if voxels.dtype.isnative:
        return voxels
    return voxels.byteswap(inplace=True).view(voxels.dtype.newbyteorder("="))


def read_part(
    path: Path, shape: tuple[int, ...], dtype: np.dtype[np.generic], place: int
) -> NDArray[np.generic]:
    """Read voxels at an offset of a file, plain or unpacked; more may follow."""
    with path.open("rb") as file:
        encoding = encoding_of(file.read(3))
    if encoding != "raw":
        return read_block(Block(path, shape, dtype, 0, encoding, skip=place, more=True))
    block = Block(path, shape, dtype, place)
    check_present(path, path.stat().st_size - place, block.nbytes)
    return read_block(block)


def unpacked_start(path: Path, length: int) -> bytes:
    """Return the first bytes of a file, unpacked if it is compressed with gzip or bzip2."""
    with path.open("rb") as file:
        start = file.read(max(length, 3))
        encoding = encoding_of(start)
        if encoding == "raw":
            return start[:length]
        file.seek(0)
        unpacked = gzip.GzipFile(fileobj=file) if encoding == "deflate" else bz2.BZ2File(file)
        try:
            return unpacked.read(length)
        except EOFError:
            return b""
        except (zlib.error, OSError, ValueError) as error:
            raise damaged(path, f"its compressed stream is invalid ({error})") from None


def encoding_of(start: bytes) -> Encoding:
    """Return how a file is compressed, by its first bytes."""
    if start[:2] == b"\x1f\x8b":
        return "deflate"
    return "bzip2" if start[:3] == b"BZh" else "raw"


def _inflate(file: BinaryIO, block: Block, target: NDArray[np.uint8]) -> None:
    """Decompress the rest of a file into `target`, and check that it is full."""
    done, left = -block.skip, LONGEST_REST
    try:
        for piece in _pieces(file, block.encoding):
            start = min(max(-done, 0), len(piece))
            used = memoryview(piece)[start : start + len(target) - max(done, 0)]
            if len(used) < len(piece) - start and not block.more:
                raise damaged(block.path, "it holds more voxels than its header says")
            target[max(done, 0) : max(done, 0) + len(used)] = np.frombuffer(used, np.uint8)
            left -= len(piece) - start - len(used)
            done += start + len(used)
            if left < 0:
                # Other volumes follow.
                break
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


# --- progress -----------------------------------------------------------------------------

Listener = Callable[[str, int, int], object]  # gets a name, the number done, and the total

_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)

T = TypeVar("T")


class ReadingCancelledError(VolumeError):
    """Raised by a listener within the reader to stop it."""


@contextmanager
def watched(listener: Listener) -> Iterator[None]:
    """Call a listener for reading in this thread, within a context."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def counted(what: str, items: Sequence[T]) -> Iterator[T]:
    """Yield items, and report progress before each, as with ``"slices read"``."""
    listener = _listener.get()
    for number, item in enumerate(items):
        if listener is not None:
            listener(what, number, len(items))
        yield item
