"""Movies of images with their transfer functions (TFs) below."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError
from model.files import write_atomically
from model.rendering.brightness import brighten
from model.scene.transfer_function import ColorTF, OpacityTF

SUFFIXES = (".mp4", ".gif")

STRIP_SHARE = 0.18
"""Height of the TF's plot, as a fraction of the image's."""

_BACKGROUND, _LINE = 0.1, 0.9


def write_movie(path: Path, frames: Sequence[NDArray[np.uint8]], frames_per_second: float) -> Path:
    """Write frames (H, W, 3), see :func:`movie_frame`, as a movie; return its path.

    Raises
    ------
    RenderError
        When the format is unknown, or the file cannot be written.
    """
    import imageio.v3 as iio

    if path.suffix.lower() not in SUFFIXES:
        raise RenderError(
            f"{path}: movies end in {', '.join(SUFFIXES)}; choose one of these formats."
        )
    partial = path.with_name(f".{path.stem}.partial{path.suffix}")
    try:
        if path.suffix.lower() == ".mp4":
            iio.imwrite(
                partial,
                np.stack(frames),
                fps=frames_per_second,
                plugin="FFMPEG",
                macro_block_size=2,
            )
        else:
            iio.imwrite(partial, np.stack(frames), duration=1000 / frames_per_second, loop=0)
        write_atomically(path, partial.read_bytes())
    except (OSError, ValueError, RuntimeError) as error:
        raise RenderError(f"{path}: the movie cannot be written ({error}).") from error
    finally:
        partial.unlink(missing_ok=True)
    return path


def movie_frame(
    image: NDArray[np.float32], tf: OpacityTF, colors: ColorTF, brightness: float = 1.0
) -> NDArray[np.uint8]:
    """Image (S, S, 4) on black, with a plot of its TF below: uint8 (H, S, 3), H and S even."""
    size = image.shape[1] // 2 * 2
    height = max(int(STRIP_SHARE * size) // 2 * 2, 8)
    opacity = tf.sample(count=size)
    shades = colors.sample(tf.scalar_range, size)
    level = (1 - opacity) * (height - 2)
    rows = np.arange(height)[:, None]
    strip = np.full((height, size, 3), _BACKGROUND)
    below = rows >= level
    strip[below] = np.broadcast_to(shades, strip.shape)[below]
    # The line has no gaps where the TF is steep.
    before = np.concatenate([level[:1], level[:-1]])
    on_line = (rows >= np.floor(np.minimum(level, before))) & (
        rows <= np.ceil(np.maximum(level, before))
    )
    strip[on_line] = _LINE
    picture = np.clip(np.nan_to_num(image[:size, :size, :3]), 0, 1)
    brighten(picture, brightness)
    return np.rint(255 * np.concatenate([picture, strip])).astype(np.uint8)
