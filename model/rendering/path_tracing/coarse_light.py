"""Light of few pixels on the colours of many: path-traced pictures while something moves.

What a scene shows without light is computed for every pixel in a few milliseconds, and has no
noise. Light changes slowly from pixel to pixel, and is what takes the time: it is traced, cleaned
and finished for every fourth pixel, and what it makes of the unlit colours there is interpolated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster
from model.rendering.resizing import resized

SIDE = 2
"""Pixels along either side that share light."""

APART = 2.0
"""Factor of the distance between samples along the view rays that light is traced for. The unlit
colours keep theirs: rings of far samples would flicker."""

FAINT = np.float32(0.02)
"""Colour up to which light says less and less: where nothing is, there is none."""

MOST = np.float32(4.0)
"""Largest factor of an unlit colour."""


def coarse(raster: Raster) -> Raster:
    """Return the pixels that light is traced for, for a whole picture."""
    return raster.scaled(1 / SIDE)


def light_of(lit: NDArray[np.float32], unlit: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the factors that light has colours times."""
    return np.clip((lit + FAINT) / (unlit + FAINT), 0, MOST)


def relit(
    unlit: NDArray[np.float32], light: NDArray[np.float32], unlit_there: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return a picture's unlit colours under the light of a picture of fewer pixels.

    Parameters
    ----------
    unlit : ndarray of float32, shape (rows, columns, 4)
        All pixels without light.
    light : ndarray of float32, shape (fewer rows, fewer columns, 3)
        Factors of the colours of few pixels.
    unlit_there : ndarray of float32, shape (fewer rows, fewer columns, 3)
        These without light.

    Returns
    -------
    ndarray of float32, shape (rows, columns, 4)
        As renderers return it; its opacity is that of `unlit`.
    """
    shape = unlit.shape[:2]
    weights = unlit_there + FAINT
    # Weighted by the colours: a silhouette has the light of what is inside.
    factors = resized(light * weights, shape)
    factors /= resized(weights, shape)
    picture = unlit.copy()
    picture[..., :3] = factors * (unlit[..., :3] + FAINT) - FAINT
    picture[unlit[..., 3] <= 0] = 0
    return np.clip(picture, 0, 1, out=picture)
