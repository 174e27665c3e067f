"""Path-traced pictures while something moves: light of few pixels, colours of all pixels.

Unlit colours are computed for every pixel in a few milliseconds and have no noise. Light is
expensive but changes slowly from pixel to pixel. It is traced and cleaned for one pixel in four;
there, factors from unlit to lit colours are computed, and interpolated between pixels.

Few paths per pixel leave noise, which flickers as the view turns. Averaging with the light of
previous pictures, looked up where each place was then, reduces noise and flicker.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster, resized
from model.scene.inputs import SceneInputs
from model.scene.view import NEAREST_DEPTH, Projection, View
from model.scene.volume import Volume

SIDE = 2  # pixels along either side that share light

APART = 2.0
"""Factor of the sample distance along view rays for which light is traced. Unlit colours keep the
usual distance: the rings of a larger one would flicker."""

FAINT = np.float32(0.02)
"""Added to colours before division, so that factors of nearly black colours are near 1."""

MOST_LIGHT = np.float32(4.0)  # largest factor of an unlit colour


def coarse(raster: Raster) -> Raster:
    """Return the pixels that light is traced for, for a whole picture."""
    return raster.scaled(1 / SIDE)


def light_of(lit: NDArray[np.float32], unlit: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the factors (rows, columns, 3) from unlit to lit colours."""
    return np.clip((lit + FAINT) / (unlit + FAINT), 0, MOST_LIGHT)


def relit(
    unlit: NDArray[np.float32], light: NDArray[np.float32], unlit_there: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return unlit colours (rows, columns, 4) multiplied by the light of a coarser picture.

    `light` and `unlit_there` (fewer rows, fewer columns, 3) are that picture's; opacity stays.
    """
    shape = unlit.shape[:2]
    weights = unlit_there + FAINT
    # Weighted by the colours, so that a silhouette gets the light from its inner side.
    factors = resized(light * weights, shape)
    factors /= resized(weights, shape)
    picture = unlit.copy()
    picture[..., :3] = factors * (unlit[..., :3] + FAINT) - FAINT
    picture[unlit[..., 3] <= 0] = 0
    return np.clip(picture, 0, 1, out=picture)


MOST = 4  # most pictures that are averaged: a new one has at least a quarter of the weight

SAME_PLACE = 0.03
"""Largest difference of two depths, in radii of the volume, that counts as the same place."""


@dataclass(frozen=True, eq=False)
class _Past:
    """The last picture."""

    inputs: SceneInputs
    raster: Raster
    light: NDArray[np.float32]
    counts: NDArray[np.float32]
    depth: NDArray[np.float32]


class LightHistory:
    """Averages the light of successive pictures of one volume.

    It starts again when anything but the view changes: while a TF is edited, the random numbers
    stay the same, so that all changes are due to the edit. Two alternating scenes have one each.
    """

    def __init__(self, volume: Volume) -> None:
        self._volume = volume
        self._pasts: list[_Past] = []

    def averaged(
        self,
        inputs: SceneInputs,
        raster: Raster,
        light: NDArray[np.float32],
        depth: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """Return the mean of a picture's light and of the previous ones', and store it."""
        counts = np.zeros(raster.shape, dtype=np.float32)
        past = next((each for each in self._pasts if _is_alike(each.inputs, inputs)), None)
        if past is not None and past.raster == raster:
            before, counts = self._found_again(past, inputs.view, raster, depth)
            counts = np.minimum(counts, np.float32(MOST - 1))
            share = (counts / (1 + counts))[..., None]
            light = np.asarray(light + share * (before - light), dtype=np.float32)
        others = [each for each in self._pasts if each is not past][-1:]
        self._pasts = [*others, _Past(inputs, raster, light, counts + 1, depth)]
        return light

    def _found_again(
        self, past: _Past, view: View, raster: Raster, depth: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return each pixel's past light, and how many pictures it averages."""
        proportions, radius = self._volume.proportions, self._volume.radius
        present = Projection(view, proportions)
        before = Projection(past.inputs.view, proportions)
        seen = np.isfinite(depth)
        away = np.where(seen, depth, 0) / radius
        flat = present.points(_places(raster), away).reshape(-1, 3)
        ahead = before.depths(flat).reshape(depth.shape) > NEAREST_DEPTH
        with np.errstate(divide="ignore", invalid="ignore"):
            places = np.nan_to_num(before.places(flat), posinf=0.0, neginf=0.0)
        x, y = places.reshape(*depth.shape, 2).transpose(2, 0, 1)
        columns = (x * raster.shorter + raster.width - 1) / 2
        rows = (raster.height - 1 - y * raster.shorter) / 2
        distances = radius * before.distances(flat).reshape(depth.shape)
        inside = ahead & (columns > -0.5) & (columns < raster.width - 0.5)
        inside &= (rows > -0.5) & (rows < raster.height - 0.5)
        nearest = (
            np.clip(np.rint(rows), 0, raster.height - 1).astype(np.intp),
            np.clip(np.rint(columns), 0, raster.width - 1).astype(np.intp),
        )
        with np.errstate(invalid="ignore"):
            same = np.abs(past.depth[nearest] - distances) < SAME_PLACE * radius
        counts = np.where(seen & inside & same, past.counts[nearest], 0).astype(np.float32)
        return _between(past.light, rows, columns), counts


def _is_alike(one: SceneInputs, other: SceneInputs) -> bool:
    """Whether two scenes differ by their views alone."""
    return replace(one, view=other.view) == other


def _places(raster: Raster) -> NDArray[np.float64]:
    """Return the places of a whole picture's pixels, shape (rows, columns, 2)."""
    x = (2 * np.arange(raster.width) + 1 - raster.width) / raster.shorter
    y = (raster.height - 1 - 2 * np.arange(raster.height)) / raster.shorter
    return np.stack(np.meshgrid(x, y), axis=-1)


def _between(
    image: NDArray[np.float32], rows: NDArray[np.float64], columns: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Interpolate an image (height, width, channels) at places between its pixels."""
    height, width = image.shape[:2]
    rows, columns = np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)
    top, left = (
        np.minimum(places.astype(np.intp), max(size - 2, 0))
        for places, size in ((rows, height), (columns, width))
    )
    down = (rows - top).astype(np.float32)[..., None]
    along = (columns - left).astype(np.float32)[..., None]
    below, right = np.minimum(top + 1, height - 1), np.minimum(left + 1, width - 1)
    upper = image[top, left] * (1 - along) + image[top, right] * along
    lower = image[below, left] * (1 - along) + image[below, right] * along
    return np.asarray(upper * (1 - down) + lower * down)
