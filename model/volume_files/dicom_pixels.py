"""The pixels of DICOM images: plain or compressed, as stored."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError, first_line
from model.volume_files.checks import check_present, damaged, log_of, truncated, unsupported
from model.volume_files.dicom_tags import (
    BIG_ENDIAN,
    DEFLATED,
    EXPLICIT,
    IMPLICIT,
    DicomFile,
    Frame,
    numbers_of,
    text_of,
)

PLAIN = (IMPLICIT, EXPLICIT, DEFLATED, BIG_ENDIAN)
DECODERS = {
    "1.2.840.10008.1.2.5": "dicomrle_decode",
    **dict.fromkeys(("1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51"), "jpeg_decode"),
    **dict.fromkeys(("1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70"), "ljpeg_decode"),
    **dict.fromkeys(("1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.81"), "jpegls_decode"),
    **{f"1.2.840.10008.1.2.4.{k}": "jpeg2k_decode" for k in (90, 91, 201, 202, 203)},
}
"""Decoders of imagecodecs, by UID of the transfer syntax."""


END_OF_IMAGE = b"\xff\xd9"


def stored_type(frame: Frame) -> np.dtype[np.generic]:
    """Return the native type of a frame's stored pixels."""
    file = frame.file
    if file.kind in ("f4", "f8"):
        return np.dtype(file.kind)
    bits = int((numbers_of(file.tags, "BitsAllocated") or [0])[0])
    if bits == 1:
        return np.dtype(np.uint8)
    if bits not in (8, 16, 32, 64):
        raise unsupported(file.path, f"a DICOM file of {bits} bits per pixel", "convert it")
    is_signed = (numbers_of(file.tags, "PixelRepresentation") or [0])[0] == 1
    return np.dtype(f"{'i' if is_signed else 'u'}{bits // 8}")


def bits_stored(frame: Frame) -> int:
    """Return the number of bits that hold a pixel's value."""
    allocated = stored_type(frame).itemsize * 8
    if frame.file.kind != "iu":
        return allocated
    if _allocated(frame.file) == 1:
        return 1
    stored = int((numbers_of(frame.file.tags, "BitsStored") or [allocated])[0])
    if not 1 <= stored <= allocated:
        raise damaged(frame.file.path, "its bits stored exceed its bits allocated")
    return stored


def _allocated(file: DicomFile) -> int:
    return int((numbers_of(file.tags, "BitsAllocated") or [0])[0])


def stored_pixels(frame: Frame) -> NDArray[Any]:
    """Read a frame's pixels in native byte order, without what lies in their unused bits."""
    file, dtype = frame.file, stored_type(frame)
    if file.length < 0 or file.syntax not in PLAIN:
        pixels = _decoded(frame, dtype)
    elif _allocated(file) == 1 and file.kind == "iu":
        return _bits(frame)
    else:
        stored_dtype = np.dtype(f"{file.order}{dtype.str[1:]}")
        pixels = np.empty((frame.rows, frame.columns), stored_dtype)
        with file.open() as data:
            data.seek(file.offset + frame.index * pixels.nbytes)
            there = max(min(file.length - frame.index * pixels.nbytes, pixels.nbytes), 0)
            check_present(file.path, min(data.readinto(pixels.data), there), pixels.nbytes)  # type: ignore[attr-defined]
        if not pixels.dtype.isnative:
            pixels = pixels.byteswap(inplace=True).view(dtype)
    if file.kind != "iu":
        return pixels
    allocated, stored = dtype.itemsize * 8, bits_stored(frame)
    high = int((numbers_of(file.tags, "HighBit") or [stored - 1])[0])
    above = allocated - 1 - (high if stored - 1 <= high < allocated else stored - 1)
    if allocated == stored:
        return pixels
    if dtype.kind == "u" and above == allocated - stored:
        pixels &= dtype.type((1 << stored) - 1)
    else:
        pixels <<= above
        pixels >>= allocated - stored
    return pixels


def _bits(frame: Frame) -> NDArray[np.uint8]:
    """Read the pixels of a segmentation, one bit each, packed across images."""
    file, size = frame.file, frame.rows * frame.columns
    first = frame.index * size
    with file.open() as data:
        data.seek(file.offset + first // 8)
        need = -(-(first % 8 + size) // 8)
        packed = data.read(need)
    check_present(file.path, min(len(packed), file.length - first // 8), need)
    bits = np.unpackbits(np.frombuffer(packed, np.uint8), bitorder="little")
    return bits[first % 8 : first % 8 + size].reshape(frame.rows, frame.columns).copy()


def _decoded(frame: Frame, dtype: np.dtype[np.generic]) -> NDArray[Any]:
    """Decompress a frame."""
    import imagecodecs
    from pydicom.encaps import get_frame
    from pydicom.uid import UID

    file = frame.file
    name = DECODERS.get(file.syntax)
    if name is None:
        raise unsupported(
            file.path,
            f"a DICOM file with pixels compressed as {UID(file.syntax).name}",
            "decompress the series first, for example with gdcmconv --raw",
        )
    count = int((numbers_of(file.tags, "NumberOfFrames") or [1])[0] or 1)
    with log_of("pydicom"):
        try:
            with file.open() as data:
                data.seek(file.offset)
                encoded = get_frame(data, frame.index, number_of_frames=count)
            decode = getattr(imagecodecs, name)
            if name == "dicomrle_decode":
                flat = decode(encoded, dtype.newbyteorder("<"))
                pixels = np.frombuffer(flat, dtype.newbyteorder("<"))
            else:
                _check_size(frame, name, encoded)
                pixels = decode(encoded)
        except (MemoryError, VolumeError):
            raise
        except (EOFError, IndexError):
            raise truncated(file.path, "its compressed pixels stop before the end") from None
        except Exception as error:
            raise damaged(
                file.path, f"its compressed pixels are invalid: {first_line(error)}"
            ) from None
    if pixels.size != frame.rows * frame.columns:
        raise damaged(file.path, f"its compressed pixels are {pixels.shape}")
    pixels = np.array(pixels.reshape(frame.rows, frame.columns))
    if dtype.kind == "f" or pixels.dtype.kind not in "iu":
        return pixels.astype(dtype)
    # Decoders do not know whether numbers are signed: the same bits, then.
    return pixels.astype(f"u{dtype.itemsize}").view(dtype)


def _check_size(frame: Frame, name: str, encoded: bytes) -> None:
    """Check the size in a JPEG stream's own head against the tags, before memory is taken."""
    data = bytes(encoded)
    if name == "jpegls_decode" and not data.rstrip(b"\0").endswith(END_OF_IMAGE):
        # CharLS looks for the end for half a minute.
        raise truncated(frame.file.path, "its compressed pixels stop before the end")
    found = None
    if name in ("jpeg_decode", "ljpeg_decode", "jpegls_decode"):
        place = 2
        while place + 9 <= len(data) and data[place] == 0xFF:
            marker = data[place + 1]
            if marker in (0xC0, 0xC1, 0xC2, 0xC3, 0xF7):
                found = (
                    int.from_bytes(data[place + 5 : place + 7], "big"),
                    int.from_bytes(data[place + 7 : place + 9], "big"),
                )
                break
            place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
    elif name == "jpeg2k_decode":
        place = data.find(b"\xff\x4f\xff\x51")
        if place >= 0:
            x1, y1, x0, y0 = (
                int.from_bytes(data[place + 8 + 4 * k : place + 12 + 4 * k], "big")
                for k in range(4)
            )
            found = (y1 - y0, x1 - x0)
    else:
        return
    if found != (frame.rows, frame.columns):
        raise damaged(frame.file.path, "its compressed pixels have another size than its tags")


def padding_mask(frame: Frame, pixels: NDArray[Any]) -> NDArray[np.bool_] | None:
    """Mark the stored pixels that the file declares to be padding; None where it declares none."""
    tags = frame.file.tags
    values = [
        _padding(tags, name, pixels) for name in ("PixelPaddingValue", "PixelPaddingRangeLimit")
    ]
    if values[0] is None:
        return None
    low, high = values[0], values[0] if values[1] is None else values[1]
    return (pixels >= min(low, high)) & (pixels <= max(low, high))


def _padding(tags: Any, name: str, pixels: NDArray[Any]) -> int | None:
    """Return a padding value as a number of the pixels' type, whatever it is declared as."""
    if not text_of(tags, name):
        return None
    numbers = numbers_of(tags, name)
    if not numbers:
        return None
    value = int(numbers[0])
    if pixels.dtype.kind not in "iu":
        return value
    limits, wide = np.iinfo(pixels.dtype), 1 << (8 * pixels.dtype.itemsize)
    if value > limits.max:
        value -= wide
    elif value < limits.min:
        value += wide
    return value if limits.min <= value <= limits.max else None
