"""A stack of DICOM images as a grid: order, distances and shear, pixels and values."""

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.volume import Caution, FileFacts
from model.volume_files import checks
from model.volume_files.blocks import counted
from model.volume_files.dicom_tags import PLAIN, DicomFile, Frame, number_in, numbers_of, value_of
from model.volume_files.grid import Grid, placed

EVEN = 0.02  # relative difference below which slice distances count as equal
MOST_LISTED = 4
LEAST_STEP = 1e-6  # distance in mm up to which two images are at the same position
MOST_GAPS = 0.2  # largest share of distances that are gaps rather than a change

_KINDS = {
    "MONOCHROME1": "The file shows its lowest value as white (MONOCHROME1); the values are as "
    "stored, not inverted.",
    "PALETTE COLOR": "The colours of the file's look-up table are left out; its indices are read.",
}

_Order = tuple[list[Frame], float | None, tuple[str, ...], tuple[float, float]]
"""Images in the order of their positions, their distance, notes, and shift along x and y."""


def read_stack(images: Sequence[Frame]) -> Grid:
    """Read images as a volume."""
    frames, step, notes, shear = _ordered(list(images))
    first = frames[0]
    folder = first.file.path if len({f.file.path for f in frames}) == 1 else first.file.path.parent
    dtype = value_type(frames)
    checks.check_grid(folder, (first.columns, first.rows, len(frames)), dtype)
    # Tags often allow for more bits than there are: renderers draw 16 as they are.
    least = np.dtype(np.int16) if dtype == np.int32 and stored_type(first).itemsize < 4 else dtype
    values = np.empty((len(frames), first.rows, first.columns), least)
    plane = np.empty(values.shape[1:], dtype)
    missing: NDArray[np.bool_] | None = None
    for z, frame in enumerate(counted("slices read", frames)):
        padding = _fill(plane, frame)
        if padding is not None and padding.any():
            if missing is None:
                missing = np.zeros(values.shape, bool)
            missing[z] = padding
        measured = plane if padding is None else plane[~padding]
        if values.dtype != dtype and (measured != measured.astype(values.dtype)).any():
            values = values.astype(dtype)
        values[z] = plane
    units = {frame.units for frame in frames}
    said = _KINDS.get(first.file.text("PhotometricInterpretation"))
    mm, declared = "mm" if first.spacing else "", "" if values.dtype == dtype else dtype.name
    grid = Grid(
        values,
        origin=first.position or (0.0, 0.0, 0.0),
        units=units.pop() if len(units) == 1 else "",
        notes=notes + ((Caution(said),) if said else ()),
        missing=missing,
        facts=FileFacts("DICOM", mm, declared_type=declared),
    )
    y, x = first.spacing if len(first.spacing) == 2 else (None, None)
    distance = None if step is None else float(np.linalg.norm([step, *shear]))
    if not (first.orientation and first.position):
        return placed(grid, (x, y, distance))
    axes = np.array([first.orientation[:3], first.orientation[3:], first.normal])
    axes[2] = [*shear, step or 1.0] @ axes
    return placed(grid, (x, y, distance), axes, "LPS")


def value_type(frames: Sequence[Frame]) -> np.dtype[np.generic]:
    """Type for all images' rescaled pixels: an integer type if the values are integers and fit."""
    stored = stored_type(frames[0])
    if stored.kind == "f":
        return stored
    if value_of(frames[0].file.tags, "ModalityLUTSequence"):
        return np.dtype(np.int32)
    scales = {(frame.slope, frame.intercept) for frame in frames}
    if scales == {(1.0, 0.0)}:
        return stored
    if any(not number.is_integer() for scale in scales for number in scale):
        return np.dtype(np.float32 if stored.itemsize <= 2 else np.float64)
    bits = max(bits_stored(frame) for frame in {id(f.file): f for f in frames}.values())
    signed = stored.kind == "i"
    lowest, highest = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    ends = [slope * end + intercept for slope, intercept in scales for end in (lowest, highest)]
    for candidate in (np.int16, np.int32):
        if np.iinfo(candidate).min <= min(ends) and max(ends) <= np.iinfo(candidate).max:
            return np.dtype(candidate)
    return np.dtype(np.float64)


def _fill(plane: NDArray[Any], frame: Frame) -> NDArray[np.bool_] | None:
    """Put an image's values into a slice; return the padding."""
    pixels = stored_pixels(frame)
    padding = padding_mask(frame, pixels)
    table = value_of(frame.file.tags, "ModalityLUTSequence")
    if table and not frame.is_rescaled:
        plane[:] = _looked_up(pixels, table[0])
    else:
        # Integers that overflow in between come back with the next step.
        plane[:] = pixels
        if frame.is_rescaled:
            plane *= plane.dtype.type(frame.slope)
            plane += plane.dtype.type(frame.intercept)
    return padding


def _looked_up(pixels: NDArray[np.generic], table: object) -> NDArray[np.generic]:
    """Apply a modality's look-up table, constant beyond its ends."""
    descriptor = [int(number) for number in value_of(table, "LUTDescriptor")]  # type: ignore[arg-type]
    count, first = descriptor[0] or 1 << 16, descriptor[1]
    data = value_of(table, "LUTData")  # type: ignore[arg-type]
    if isinstance(data, bytes):
        data = np.frombuffer(data, np.uint8 if len(data) == count else np.uint16)
    entries = np.asarray(data)[:count].astype(np.int32)
    if first > 1 << 15 and pixels.dtype.kind == "i":
        first -= 1 << 16
    places = np.clip(pixels.astype(np.int64) - first, 0, len(entries) - 1)
    return entries[places]


def heights(frames: Sequence[Frame]) -> np.ndarray:
    """Return each image's distance along the first one's normal, in mm."""
    normal = np.array(frames[0].normal)
    return np.array([np.dot(frame.position, normal) for frame in frames])


def _ordered(frames: list[Frame]) -> _Order:
    """Sort images along their normal, else by their location or number."""
    places: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()
    if is_placed := all(frame.position for frame in frames):
        places = heights(frames)
        # If all are at the same position, it is useless.
        is_placed = len(frames) == 1 or bool(np.ptp(places) > LEAST_STEP)
    if not is_placed:
        found = [numbers_of(frame.file.tags, "SliceLocation") for frame in frames]
        places = np.array([place[0] for place in found]) if all(found) else None
        if places is None or len(frames) < 2 or len({*places}) < len(frames):
            said = "The slices give no position; they are ordered by number."
            frames = sorted(frames, key=lambda frame: frame.number)
            return frames, frames[0].thickness, (said,), (0.0, 0.0)
        notes = ("The slices give no position; they are ordered by their location.",)
    assert places is not None
    order = np.argsort(places, kind="stable")
    frames, places = [frames[k] for k in order], places[order]
    if len(frames) == 1:
        return frames, frames[0].thickness, (), (0.0, 0.0)
    steps = np.diff(places)
    if not steps.min() > LEAST_STEP:
        at = int(np.argmin(steps))
        raise VolumeError(
            f"{frames[0].file.path.parent}: several slices of the series lie at one position "
            f"({frames[at].file.path.name} and {frames[at + 1].file.path.name}), and no field "
            "tells them apart; keep one time step or echo in the folder."
        )
    step = float(np.median(steps))
    notes += _gap_notes(places, steps, step)
    return frames, step, notes, _shear(frames, places) if is_placed else (0.0, 0.0)


def _gap_notes(
    places: NDArray[np.float64], steps: NDArray[np.float64], step: float
) -> tuple[str, ...]:
    """Describe missing slices or unequal distances."""
    if steps.max() - steps.min() <= EVEN * step:
        return ()
    gaps = []
    for k, each in enumerate(steps):
        count = round(each / step) - 1
        if count >= 1 and abs(each / step - count - 1) < 0.1:
            slices = "1 slice" if count == 1 else f"{count} slices"
            ends = f"{places[k]:.5g} and {places[k + 1]:.5g} mm"
            gaps.append(f"{slices} between slices {k} and {k + 1} (at {ends})")
    if 0 < len(gaps) <= max(len(steps) * MOST_GAPS, 1):
        listed = ", ".join(gaps[:MOST_LISTED])
        listed += f" and {len(gaps) - MOST_LISTED} more gaps" if len(gaps) > MOST_LISTED else ""
        said = f"Slices may be missing: {listed}; {step:g} mm is used for all distances."
    else:
        said = (
            f"The slices are {steps.min():g} to {steps.max():g} mm apart: some are missing, or "
            f"their distance changes; {step:g} mm is used for all, so the shape is not true "
            "everywhere."
        )
    return (Caution(said),)


def _shear(ordered: list[Frame], places: NDArray[np.float64]) -> tuple[float, float]:
    """Return the shift per slice along rows and columns, if it is constant."""
    axes = np.array(ordered[0].orientation or (1.0, 0.0, 0.0, 0.0, 1.0, 0.0))
    positions = np.array([frame.position for frame in ordered])
    sideways = (positions - positions[0]) @ axes.reshape(2, 3).T
    relative = (places - places[0]) / (places[-1] - places[0])
    total = sideways[-1]
    if np.abs(sideways - np.outer(relative, total)).max() > 0.1 * max(np.abs(total).max(), 1.0):
        return 0.0, 0.0
    count = len(ordered) - 1
    return float(total[0] / count), float(total[1] / count)


# --- pixels -------------------------------------------------------------------------------

DECODERS = {
    "1.2.840.10008.1.2.5": "dicomrle_decode",
    **dict.fromkeys(("1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51"), "jpeg_decode"),
    **dict.fromkeys(("1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70"), "ljpeg_decode"),
    **dict.fromkeys(("1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.81"), "jpegls_decode"),
    **{f"1.2.840.10008.1.2.4.{k}": "jpeg2k_decode" for k in (90, 91, 201, 202, 203)},
}
"""Decoders of imagecodecs, by UID of the transfer syntax."""

END_OF_IMAGE = b"\xff\xd9"
ENDS_EARLY = "its compressed pixels stop before the end"


def stored_type(frame: Frame) -> np.dtype[np.generic]:
    """Return the native type of a frame's stored pixels."""
    file = frame.file
    if file.kind in ("f4", "f8"):
        return np.dtype(file.kind)
    bits = _allocated(file)
    if bits == 1:
        return np.dtype(np.uint8)
    if bits not in (8, 16, 32, 64):
        raise checks.unsupported(file.path, f"a DICOM file of {bits} bits per pixel", "convert it")
    is_signed = number_in(file.tags, "PixelRepresentation") == 1
    return np.dtype(f"{'i' if is_signed else 'u'}{bits // 8}")


def bits_stored(frame: Frame) -> int:
    """Return the number of bits that hold a pixel's value."""
    allocated = stored_type(frame).itemsize * 8
    if frame.file.kind != "iu":
        return allocated
    if _allocated(frame.file) == 1:
        return 1
    stored = int(number_in(frame.file.tags, "BitsStored", allocated))
    if not 1 <= stored <= allocated:
        raise checks.damaged(frame.file.path, "its bits stored exceed its bits allocated")
    return stored


def _allocated(file: DicomFile) -> int:
    return int(number_in(file.tags, "BitsAllocated"))


def stored_pixels(frame: Frame) -> NDArray[Any]:
    """Read a frame's pixels in native byte order, with unused bits cleared."""
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
            checks.check_present(file.path, min(data.readinto(pixels.data), there), pixels.nbytes)  # type: ignore[attr-defined]
        if not pixels.dtype.isnative:
            pixels = pixels.byteswap(inplace=True).view(dtype)
    if file.kind != "iu":
        return pixels
    allocated, stored = dtype.itemsize * 8, bits_stored(frame)
    high = int(number_in(file.tags, "HighBit", stored - 1))
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
    checks.check_present(file.path, min(len(packed), file.length - first // 8), need)
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
        raise checks.unsupported(
            file.path,
            f"a DICOM file with pixels compressed as {UID(file.syntax).name}",
            "decompress the series first, for example with gdcmconv --raw",
        )
    count = int(number_in(file.tags, "NumberOfFrames")) or 1
    says, cut_off = "its compressed pixels are invalid: {}", (EOFError, IndexError)
    with checks.errors_of(file.path, says, "pydicom", cut_off=cut_off, missing=ENDS_EARLY):
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
    if pixels.size != frame.rows * frame.columns:
        raise checks.damaged(file.path, f"its compressed pixels are {pixels.shape}")
    pixels = np.array(pixels.reshape(frame.rows, frame.columns))
    if dtype.kind == "f" or pixels.dtype.kind not in "iu":
        return pixels.astype(dtype)
    # Decoders do not know whether numbers are signed: keep the bits.
    return pixels.astype(f"u{dtype.itemsize}").view(dtype)


def _check_size(frame: Frame, name: str, encoded: bytes) -> None:
    """Check a JPEG stream's size against the tags before memory is allocated."""
    data = bytes(encoded)
    if name == "jpegls_decode" and not data.rstrip(b"\0").endswith(END_OF_IMAGE):
        # CharLS searches for the end for half a minute.
        raise checks.truncated(frame.file.path, ENDS_EARLY)
    found = None
    if name == "jpeg2k_decode":
        place = data.find(b"\xff\x4f\xff\x51")
        if 0 <= place <= len(data) - 24:
            x1, y1, x0, y0 = struct.unpack_from(">4I", data, place + 8)
            found = (y1 - y0, x1 - x0)
    else:
        place = 2
        while place + 9 <= len(data) and data[place] == 0xFF and found is None:
            marker, length, _, rows, columns = struct.unpack_from(">BHBHH", data, place + 1)
            found = (rows, columns) if marker in (0xC0, 0xC1, 0xC2, 0xC3, 0xF7) else None
            place += 2 + length
    if found != (frame.rows, frame.columns):
        raise checks.damaged(
            frame.file.path, "its compressed pixels have another size than its tags"
        )


def padding_mask(frame: Frame, pixels: NDArray[Any]) -> NDArray[np.bool_] | None:
    """Mark the stored pixels that the file declares as padding; None without any."""
    ends = []
    for name in ("PixelPaddingValue", "PixelPaddingRangeLimit"):
        value = next(map(int, numbers_of(frame.file.tags, name)), None)
        if value is not None and pixels.dtype.kind in "iu":
            # Whatever its declared type.
            limits, wide = np.iinfo(pixels.dtype), 1 << (8 * pixels.dtype.itemsize)
            value += wide * (int(value < limits.min) - int(value > limits.max))
            value = value if limits.min <= value <= limits.max else None
        ends.append(value)
    if ends[0] is None:
        return None
    other = ends[0] if ends[1] is None else ends[1]
    return (pixels >= min(ends[0], other)) & (pixels <= max(ends[0], other))
