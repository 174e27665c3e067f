"""Times and errors of images while something moves, at each number of pixels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from app.engines.drawer import go_on_if
from app.engines.image import Image
from app.engines.pace import SCALES
from app.engines.requests import Watch
from model.rendering.raster import Raster

COMPARED = 128
"""Pixels along each side, at most, by which two images are compared."""

Rgba = NDArray[np.float32]


def traded(moving: Callable[[Raster], Image], whole: Raster, truth: Rgba, watch: Watch) -> Rgba:
    """Draw an image with each number of pixels, and measure it against the one at rest."""
    found: list[tuple[float, float]] = []
    for scale in sorted(SCALES):
        go_on_if(watch)
        watch.note(len(found) / len(SCALES))
        image = moving(whole.scaled(scale))
        found.append((image.seconds, distance(image.rgba, truth)))
    return np.array(found, dtype=np.float32)


def distance(coarse: Rgba, fine: Rgba) -> float:
    """Root mean squared difference of two images' colours, as a screen shows them.

    Parameters
    ----------
    coarse : ndarray of float32, shape (h, w, 4)
        Interpolated linearly where the other has its pixels.
    fine : ndarray of float32, shape (H, W, 4)
        A grid of its pixels is compared.
    """
    places = [_grid(count) for count in fine.shape[:2]]
    truth = fine[np.ix_(*places)][..., :3]
    found = coarse[..., :3]
    for axis in (0, 1):
        have = coarse.shape[axis]
        at = np.clip((places[axis] + 0.5) * have / fine.shape[axis] - 0.5, 0, have - 1)
        before = np.floor(at).astype(np.intp)
        part = (at - before).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        after = np.minimum(before + 1, have - 1)
        found = np.take(found, before, axis) * (1 - part) + np.take(found, after, axis) * part
    one, other = (np.clip(np.nan_to_num(image), 0, 1) for image in (found, truth))
    return float(np.sqrt(np.mean((one - other).astype(np.float64) ** 2)))


def _grid(count: int) -> NDArray[np.intp]:
    """Places of at most :data:`COMPARED` pixels, evenly over all of them."""
    chosen = min(count, COMPARED)
    return ((np.arange(chosen) + 0.5) * count / chosen).astype(np.intp)
