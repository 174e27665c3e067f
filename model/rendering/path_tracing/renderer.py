"""The path tracer as a renderer, with pictures that become better the longer it draws."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from model.measurements import processors
from model.rendering.path_tracing.estimate import Estimate, estimate_of
from model.rendering.path_tracing.paths import trace_rows
from model.rendering.path_tracing.scattering import (
    Optics,
    facet_albedo,
    shares,
    single_scattering_albedo,
)
from model.rendering.path_tracing.tracking import CLEAREST, Extinction, Scatterer
from model.rendering.raster import BLUR, Raster, blur_of
from model.rendering.raycast.batch import CLOSE
from model.rendering.raycast.classification import LARGEST_ERROR, color_table, opacity_table
from model.rendering.raycast.illumination import travel_direction
from model.rendering.raycast.marching import draw_rows
from model.rendering.raycast.rays import camera_array
from model.rendering.raycast.renderer import NO_DEPTH, KernelVoxels
from model.rendering.raycast.shading import faces_of
from model.rendering.scalars import LABEL_NOISE, noise_of
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.scene import LightDirection
from model.scene.transfer_function import OpacityTF
from model.scene.volume import Volume

SAMPLES = 64  # samples of each pixel where no number is asked for

PIXELS_PER_TASK, PATHS_PER_TASK = 1024, 4096
"""Sizes of tasks: small, so that a pass ends soon after it is no longer wanted."""

MOST_TOGETHER = 16
"""Samples of a pixel that are traced together, as they share one pass along the view ray."""

FINER, FINEST = 4, 16
"""Factors by which samples along view rays are denser at rest, and there where voxels are large, as
each step would show as a ring on smooth surfaces. Later collisions take most of the time."""

NOISE = 3.0
"""Gradient, in standard deviations of the voxels' noise, that is a surface in half of all cases."""

LABEL_STEEPNESS = 6.0
"""Factor of a label's gradient, which is 0.75 at its boundary: a surface in 99 % of all cases."""


@dataclass(frozen=True)
class Lamp:
    """Light of a scene, and how it scatters."""

    key: float = 0.75  # radiance of a white surface that faces the light
    sky: float = 0.25  # radiance from all directions; a white surface that faces the light has both
    radius: float = 8.0  # angular radius of the light in degrees, above 0
    asymmetry: float = 0.0  # mean cosine of the phase function, -1 to 1; 0 is isotropic
    gloss: float = 0.04  # share of the light that surfaces mirror
    sharpness: float = 30.0  # exponent of the gloss
    surfaces: bool = True  # whether steep gradients, and the faces of what is shown, are surfaces
    bounces: int = 32  # most collisions of a path; light that has more is missing


class _Seen(NamedTuple):
    """Arguments of view rays."""

    scatterer: Scatterer
    camera: NDArray[np.float64]
    step: float  # distance of samples in the world
    close: bool  # whether it is at most `CLOSE`


class PathTracer:
    """Renders one volume under a distant light and an even sky, scattered many times.

    Opacity and silhouette are the ray caster's. The light is that of inputs without one; the
    distance of samples along view rays is in voxels; seeds are 0 to 2^30. There is a thread per
    processor by default, on which pictures do not depend.
    """

    def __init__(
        self,
        volume: Volume,
        light: LightDirection | None = None,
        sample_distance: float = 0.5,
        *,
        seed: int = 0,
        lamp: Lamp | None = None,
        threads: int | None = None,
    ) -> None:
        self.sample_distance = sample_distance
        self._volume, self._seed = volume, seed
        self._light = light or LightDirection()
        self._lamp = lamp or Lamp()
        threads = threads or processors()
        self._executor = ThreadPoolExecutor(threads, thread_name_prefix="path")
        self._voxels = voxels = KernelVoxels(volume, self._executor)
        self._noise = noise_of(voxels.scalars)
        self._steepness = 1 / _typical_difference(voxels.scalars, voxels.width)

        # Without `self`: a reference cycle would keep the voxels alive.
        def extinction(
            voxels: KernelVoxels, mask: Mask | None, opacity_tf: OpacityTF
        ) -> Extinction:
            opacity = opacity_table(opacity_tf, volume.scalar_range, sample_distance, mask)
            return Extinction.of(opacity, sample_distance, voxels.under(mask).cells)

        self._extinction = lru_cache(maxsize=4)(extinction)
        blurred = partial(KernelVoxels, volume, self._executor, is_blurred=True)
        self._blurred = lru_cache(maxsize=1)(blurred)

    @property
    def volume(self) -> Volume:
        """The volume that is drawn."""
        return self._volume

    def render(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        samples: int = SAMPLES,
        *,
        go_on: Callable[[], object] | None = None,
    ) -> NDArray[np.float32]:
        """Render one image of some samples of each pixel; see :mod:`model.rendering.renderer`."""
        *_, last = self.refine(inputs, size, samples, sample_distance=sample_distance)
        return last.rgba

    def refine(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        samples: int,
        sample_distance: float | None = None,
    ) -> Iterator[Estimate]:
        """Draw a picture with ever more samples, and yield it after 1, 2, 4, 8 ... and the last."""
        return filter(
            None, self.refine_in_turns(inputs, size, samples, lambda: True, sample_distance)
        )

    def refine_in_turns(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        samples: int,
        wanted: Callable[[], bool],
        sample_distance: float | None = None,
        depth: NDArray[np.float32] = NO_DEPTH,
        at_rest: bool = True,
    ) -> Iterator[Estimate | None]:
        """Draw a picture as :meth:`refine`, and yield None whenever it is not wanted for now.

        `wanted` is asked every few milliseconds, from any thread. Whoever asks for more goes on
        where this has paused. The depth (rows, columns) is filled as by
        :meth:`RaycastRenderer.frame`. Surfaces of large voxels are smooth at rest.
        """
        raster = Raster.of(size)
        seen = self._seen(inputs, raster, sample_distance, at_rest)
        while (unlit := self._unlit(inputs, seen, raster, wanted, depth)) is None:
            yield None
        optics, opacity = self._optics(inputs), np.ascontiguousarray(unlit[..., 3:])
        place = raster.left, raster.top, raster.width
        traced = *seen[:1], optics, *seen[1:], opacity, place
        sums = np.zeros((2, *raster.shape, 3), dtype=np.float32)
        for part in _passes(samples):

            def task(tile: Raster, part: tuple[int, int] = part) -> None:
                ends = tile.top, tile.bottom, tile.left, tile.right
                trace_rows(*traced, ends, part, self._seed, sums)

            left = list(_tiles(raster, part[1] - part[0]))
            while left := self._run(task, left, wanted):
                yield None
            done = part[1]
            if done & (done - 1) == 0 or done == samples:
                yield estimate_of(sums, unlit, done)

    def unlit(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        wanted: Callable[[], bool] = lambda: True,
        sample_distance: float | None = None,
    ) -> NDArray[np.float32] | None:
        """Draw unlit colours and opacity, at which paths begin; None if no longer wanted."""
        raster = Raster.of(size)
        seen = self._seen(inputs, raster, sample_distance, at_rest=False)
        return self._unlit(inputs, seen, raster, wanted)

    def close(self) -> None:
        """End the threads; the renderer cannot be used afterwards."""
        self._executor.shutdown()

    def _run(
        self, task: Callable[[Raster], None], tiles: Iterable[Raster], wanted: Callable[[], bool]
    ) -> list[Raster]:
        """Call a task for each tile while that is wanted; return the tiles that are left."""

        def part(tile: Raster) -> Raster | None:
            if not wanted():
                return tile
            task(tile)
            return None

        return list(filter(None, self._executor.map(part, tiles)))

    def _seen(
        self, inputs: SceneInputs, raster: Raster, distance: float | None, at_rest: bool
    ) -> _Seen:
        distance, volume, voxels = distance or self.sample_distance, self._volume, self._voxels
        blur = blur_of(inputs.view, volume, raster) if at_rest else 0.0
        is_nearest = inputs.is_nearest(volume)
        if blur > 0 and not blur_of(inputs.view, volume, raster, volume.voxel_size) > 0:
            # Only slices are thick. Splines would take three times as long as blurred voxels.
            blur, voxels = 0.0, voxels if is_nearest else self._blurred()
        if blur > 0:
            distance /= FINEST
        elif at_rest and not is_nearest:
            distance = min(distance / FINER, CLOSE)
        return _Seen(
            self._scatterer(inputs, voxels, distance, blur),
            camera_array(inputs.view, volume, raster, inputs.part),
            distance * volume.voxel_size,
            distance <= CLOSE and not is_nearest,
        )

    def _unlit(
        self,
        inputs: SceneInputs,
        seen: _Seen,
        raster: Raster,
        wanted: Callable[[], bool],
        depth: NDArray[np.float32] = NO_DEPTH,
    ) -> NDArray[np.float32] | None:
        unlit = np.zeros((*raster.shape, 4), dtype=np.float32)
        ends = np.float32(LARGEST_ERROR / 2)
        medium = seen.scatterer.medium
        looks = color_table(inputs.color_tf, self._volume.scalar_range, medium.alphas)
        arguments = medium, looks, None, None, ends, seen.camera, seen.step

        def task(tile: Raster) -> None:
            draw_rows(*arguments, (tile.top, tile.bottom), unlit, depth, seen.close)

        if self._run(task, _rows(raster), wanted):
            return None
        return np.clip(unlit, 0, 1, out=unlit)

    def _scatterer(
        self, inputs: SceneInputs, voxels: KernelVoxels, distance: float, blur: float
    ) -> Scatterer:
        volume = self._volume
        extinction = self._extinction(voxels, inputs.mask, inputs.opacity_tf)
        opacity = opacity_table(inputs.opacity_tf, volume.scalar_range, distance, inputs.mask)
        if not inputs.is_nearest(volume):
            # As dense as for later collisions, or light would leave surfaces from their very front.
            np.minimum(opacity, 1 - CLEAREST ** (distance / self.sample_distance), out=opacity)
        if blur > 0:
            extinction = extinction.of_splines(voxels.under(inputs.mask).cells.shape)
        medium = voxels.medium(inputs, opacity, extinction.cells)
        return Scatterer(
            medium._replace(blur=np.float32(blur), smooth=np.float32(blur / BLUR)),
            extinction.majorants,
            extinction.levels,
            faces_of(inputs.part, volume),
            tuple(np.float32(volume.voxel_size / s) for s in volume.spacing),
        )

    def _optics(self, inputs: SceneInputs) -> Optics:
        lamp, volume = self._lamp, self._volume
        towards = -travel_direction(inputs.view, inputs.light or self._light)
        is_nearest = inputs.is_nearest(volume)
        steep = LABEL_STEEPNESS if is_nearest else self._steepness
        steep = steep if lamp.surfaces else 0.0
        colors = color_table(inputs.color_tf, volume.scalar_range).reshape(-1, 4)
        scatters = partial(single_scattering_albedo, asymmetry=lamp.asymmetry)
        return Optics(
            tuple(map(np.float32, towards)),
            np.float32(math.cos(math.radians(lamp.radius))),
            np.float32(lamp.key),
            np.float32(lamp.sky),
            np.float32(lamp.asymmetry),
            np.float32(lamp.gloss),
            np.float32(lamp.sharpness),
            tuple(np.float32(steep * volume.voxel_size / s) for s in volume.spacing),
            np.float32((NOISE * (LABEL_NOISE if is_nearest else self._noise)) ** 4),
            tuple(np.float32(1 / s) for s in volume.spacing),
            np.float32(lamp.surfaces),
            lamp.bounces,
            # Of samples at the usual distance: what a surface is does not depend on the picture.
            opacity_table(
                inputs.opacity_tf, volume.scalar_range, self.sample_distance, inputs.mask
            ),
            shares(colors, facet_albedo).ravel(),
            shares(colors, scatters).ravel(),
        )


def questions(raster: Raster, samples: int) -> int:
    """Count how often :meth:`PathTracer.refine` asks whether a picture is still wanted."""
    traced = (len(list(_tiles(raster, last - first))) for first, last in _passes(samples))
    return len(list(_rows(raster))) + sum(traced)


def _rows(raster: Raster) -> Iterator[Raster]:
    """Divide the pixels that are drawn into whole rows, a few at a time."""
    rows = max(PIXELS_PER_TASK // raster.columns, 1)
    return Raster(raster.columns, raster.rows).tiles(raster.columns, rows)


def _tiles(raster: Raster, together: int) -> Iterator[Raster]:
    """Divide them into tiles, in each pixel of which some samples are traced together."""
    pixels = min(PIXELS_PER_TASK, PATHS_PER_TASK // together)
    columns = min(raster.columns, pixels)
    return Raster(raster.columns, raster.rows).tiles(columns, pixels // columns)


def _passes(samples: int) -> Iterator[tuple[int, int]]:
    """Yield the samples that are traced together: first, and the one after the last.

    A pass ends at each power of two, after which a picture is shown.
    """
    done, shown = 0, 1
    while done < samples:
        end = min(done + MOST_TOGETHER, shown, samples)
        yield done, end
        done = end
        if done == shown:
            shown *= 2


def _typical_difference(scalars: NDArray[Any], width: float) -> float:
    """Difference of two voxels, two apart, that is usual where there is any structure."""
    thin = scalars[:: max(1, scalars.shape[0] // 64), ::2, :]
    apart = np.abs(thin[..., 2:].astype(np.float32) - thin[..., :-2].astype(np.float32))
    steep = apart[apart > 0.04 * width]
    return float(np.median(steep)) if steep.size else width
