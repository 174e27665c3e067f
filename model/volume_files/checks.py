"""Checks of a file before memory is allocated, and the errors that describe defects."""

import logging
import math
import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from model.errors import VolumeError, first_line, reason


def readable_size(count: int) -> str:
    """Format a number of bytes for display: ``"1.5 GiB"``."""
    size = float(count)
    for unit in ("bytes", "KiB", "MiB", "GiB", "TiB"):
        if size < 1024 or unit == "TiB":
            break
        size /= 1024
    return f"{count} bytes" if unit == "bytes" else f"{size:.1f} {unit}"


def times(dimensions: Sequence[int]) -> str:
    """Format dimensions for display: ``"256 x 256 x 110"``."""
    return " x ".join(str(n) for n in dimensions)


def number_of(value: Any) -> float | None:
    """Return a finite number or text as a number; None for anything else."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def physical_memory() -> int | None:
    """Return the machine's memory in bytes; None if unknown."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def check_grid(path: Path, dimensions: Sequence[int], dtype: DTypeLike, components: int = 1) -> int:
    """Check that a header describes a volume that fits into memory."""
    if any(n < 1 for n in dimensions) or components < 1:
        raise VolumeError(
            f"{path}: the header gives the dimensions {times(dimensions)}, which cannot be; "
            "the file is damaged, or of another format."
        )
    if len(dimensions) < 3 or min(dimensions) < 2:
        raise VolumeError(
            f"{path}: this is a flat image of {times(dimensions)} pixels, not a volume; "
            "choose a file with at least two voxels along each of three axes."
        )
    if len(dimensions) > 3:
        raise VolumeError(
            f"{path}: the grid of {times(dimensions)} has {len(dimensions)} axes; "
            "save one time step or channel of it as a volume of three."
        )
    need = math.prod(dimensions) * components * np.dtype(dtype).itemsize
    memory = physical_memory()
    if memory is not None and need > memory:
        raise VolumeError(
            f"{path}: the header claims {times(dimensions)} voxels, {readable_size(need)}, "
            f"but this machine has {readable_size(memory)} of memory; "
            "crop or downsample the volume, or correct the header."
        )
    return need


def check_present(path: Path, present: int, need: int) -> None:
    """Raise VolumeError if fewer bytes of voxels are present than the header requires."""
    if present < need:
        raise truncated(
            path, f"it has {max(present, 0)} of the {need} bytes of voxels that its header requires"
        )


def truncated(path: Path, how: str) -> VolumeError:
    """Return the error for a file that ends too early; `how` names the missing part."""
    return VolumeError(f"{path}: the file is truncated ({how}); copy or download it again.")


def file_beside(header: Path, name: str) -> Path:
    """Return a file that a header names; refuse one outside its folder."""
    folder = header.parent.resolve()
    try:
        path = (folder / name).resolve()
        is_there = path.is_file()
    except (OSError, ValueError):
        # An invalid file name.
        path, is_there = folder, False
    if not path.is_relative_to(folder):
        raise VolumeError(
            f"{header}: its data file {name[:100]!r} lies outside the header's folder, from which "
            "nothing is read; put it next to the header, and write its name alone into it."
        )
    if not is_there:
        raise VolumeError(
            f"{header}: its data file {name[:100]} is missing; put it next to the header."
        )
    return path


def slices_in(folder: Path, suffixes: tuple[str, ...]) -> Iterator[Path]:
    """Yield the files of a folder that may be slices; refuse links out of it."""
    own = folder.resolve()
    for path in folder.iterdir():
        # macOS leaves a "._" file next to each file on foreign disks.
        if path.name.startswith(".") or not path.is_file():
            continue
        if not path.resolve().is_relative_to(own):
            if path.suffix.lower() in suffixes:
                raise VolumeError(
                    f"{path}: it is a link that leads out of its folder, from which nothing is "
                    "read; open the folder that it leads to, or put the files themselves here."
                )
            continue
        yield path


def damaged(path: Path, how: str) -> VolumeError:
    """Return the error for an invalid header or stream; `how` describes the defect."""
    return VolumeError(f"{path}: the file is damaged, or of another format: {how}.")


def not_a(path: Path, what: str) -> VolumeError:
    """Return the error for a file whose suffix or reader does not match its content."""
    return VolumeError(f"{path}: this is not {what}; choose another or correct its suffix.")


def unreadable(path: Path, error: OSError) -> VolumeError:
    """Return the error for a file that the system does not allow to read."""
    return VolumeError(
        f"{error.filename or path}: the file cannot be read ({reason(error)}); "
        "check the path and your permissions."
    )


def unsupported(path: Path, what: str, remedy: str) -> VolumeError:
    """Return the error for a valid file of an unsupported kind."""
    return VolumeError(f"{path}: {what} cannot be read here; {remedy}.")


@contextmanager
def log_of(*names: str) -> Iterator[list[str]]:
    """Collect warnings and errors that libraries log, and silence their warnings."""
    found = list[str]()
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: found.append(record.getMessage())  # type: ignore[method-assign]
    loggers = [logging.getLogger(name) for name in names]
    states = [(logger.propagate, logger.level) for logger in loggers]
    for logger in loggers:
        logger.propagate = False
        logger.addHandler(handler)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield found
    finally:
        for logger, (propagated, level) in zip(loggers, states, strict=True):
            logger.removeHandler(handler)
            logger.propagate = propagated
            logger.setLevel(level)


@contextmanager
def errors_of(
    path: Path,
    says: str,
    *loggers: str,
    cut_off: tuple[type[Exception], ...] = (),
    missing: str = "",
) -> Iterator[None]:
    """Convert a library's errors to damage of a file, or, for `cut_off`, to a missing part."""
    with log_of(*loggers):
        try:
            yield
        except (OSError, MemoryError, VolumeError):
            raise
        except cut_off:
            raise truncated(path, missing) from None
        except Exception as error:
            # Libraries raise errors of many kinds.
            raise damaged(path, says.format(first_line(error))) from None
