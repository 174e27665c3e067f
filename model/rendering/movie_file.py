"""Movie files, written frame by frame: MP4 or GIF."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError, missing, reason
from model.files import write_atomically

SUFFIXES = (".mp4", ".gif")


def write_movie(path: Path, frames: Iterable[NDArray[np.uint8]], frames_per_second: float) -> Path:
    """Write frames (H, W, 3) as a movie, in MP4 without an odd last row or column.

    Returns its path. Frames are taken one by one; any exception deletes the movie. Raises
    :class:`RenderError` if the format is unknown, or the file cannot be written.
    """
    import imageio.v2 as imageio

    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise RenderError(
            f"{path}: movies end in {', '.join(SUFFIXES)}; choose one of these formats."
        )
    if suffix == ".mp4" and (clause := missing("movies")) is not None:
        raise RenderError(f"{path}: for MP4 {clause}, or choose .gif")
    partial = path.with_name(f".{path.stem}.partial{suffix}")
    try:
        settings: dict[str, Any] = (
            {"fps": frames_per_second, "format": "FFMPEG", "macro_block_size": 2}
            if suffix == ".mp4"
            else {"duration": 1000 / frames_per_second, "loop": 0, "mode": "I"}
        )
        movie = imageio.get_writer(partial, **settings)
        try:
            for frame in frames:
                height, width = (n - n % 2 if suffix == ".mp4" else n for n in frame.shape[:2])
                movie.append_data(frame[:height, :width])
        finally:
            # Its own context would leave it open after an error, and the encoder running.
            movie.close()
        write_atomically(path, partial.read_bytes())
    except (OSError, ValueError, RuntimeError) as error:
        # Not with the name of the partial file.
        why = reason(error) if isinstance(error, OSError) else error
        raise RenderError(
            f"{path}: the movie cannot be written ({why}); try another place or format."
        ) from error
    finally:
        partial.unlink(missing_ok=True)
    return path
