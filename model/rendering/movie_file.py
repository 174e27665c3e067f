"""Movie files, written frame by frame: MP4 or GIF."""

from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError, first_line, missing, os_errors_as
from model.files import write_atomically

SUFFIXES = (".mp4", ".gif")


def write_movie(path: Path, frames: Iterable[NDArray[np.uint8]], frames_per_second: float) -> Path:
    """Write frames (H, W, 3) as a movie, in MP4 without an odd last row or column.

    Returns its path. Frames are taken one by one; any exception deletes the movie. Raises
    :class:`RenderError` if the format is unknown, or the file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise RenderError(
            f"{path}: movies end in {', '.join(SUFFIXES)}; choose one of these formats."
        )
    if suffix == ".mp4" and (clause := missing("movies")) is not None:
        raise RenderError(f"{path}: for MP4 {clause}, or choose .gif")
    partial = path.with_name(f".{path.stem}.partial{suffix}")
    failed = f"{path}: the movie cannot be written"
    remedy = "make room, or try another place or format"
    with os_errors_as(RenderError, failed, remedy):
        # Before anything is drawn; encoders would name this file, or no reason.
        partial.touch()
        try:
            _encode(partial, frames, frames_per_second)
            write_atomically(path, partial.read_bytes())
        except (ValueError, RuntimeError) as error:
            raise RenderError(f"{failed} ({first_line(error)}); {remedy}.") from error
        finally:
            partial.unlink(missing_ok=True)
    return path


def _encode(path: Path, frames: Iterable[NDArray[np.uint8]], frames_per_second: float) -> None:
    import imageio.v2 as imageio

    is_mp4 = path.suffix == ".mp4"
    settings: dict[str, Any] = (
        {"fps": frames_per_second, "format": "FFMPEG", "macro_block_size": 2}
        if is_mp4
        else {"duration": 1000 / frames_per_second, "loop": 0, "mode": "I"}
    )
    # Its own context would leave it open after an error, and the encoder running.
    with closing(imageio.get_writer(path, **settings)) as movie:
        for frame in frames:
            height, width = (n - n % 2 if is_mp4 else n for n in frame.shape[:2])
            movie.append_data(frame[:height, :width])
