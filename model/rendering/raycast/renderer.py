"""The ray caster as a renderer, with depth, opacity images and exact derivatives.

Above 400 lines, as images and their derivatives share tables, cells and threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.noise import noise_of
from model.rendering.opacity_correction import least_transparency, per_sample_derivative
from model.rendering.raster import Raster
from model.rendering.raycast.batch import CLOSE
from model.rendering.raycast.camera import camera_array
from model.rendering.raycast.cells import SHIFT, MinMaxCells
from model.rendering.raycast.cpu import draw_rows, draw_rows_preintegrated
from model.rendering.raycast.illumination import Illumination, gradient_light
from model.rendering.raycast.shading import Light, LightGrid
from model.rendering.raycast.shadows import Shadows, shadow_rays
from model.rendering.raycast.tables import (
    FARTHEST_LEVELS,
    LEVELS,
    LEVELS_PER_BIN,
    color_table,
    level_table,
    opacity_table,
    preintegrated_table,
)
from model.rendering.scalars import renderable_scalars
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range
from model.scene.view import View
from model.scene.volume import Volume

if TYPE_CHECKING:
    from model.rendering.raycast.cuda import Painter

NATIVE_TYPES = (np.uint8, np.uint16, np.int16, np.float32)
"""Scalar types that are rendered without conversion."""

LARGEST_ERROR = 1 / 510
"""Largest error of a pixel by skipping and early termination together: half an 8-bit step."""

ROWS_PER_TASK = 8
TASKS = 32
"""Number of tasks that differentiated windows are divided into, to balance the threads' load."""

FINE_FROM, COARSE_LIGHT = 128, 32
"""Pixels of an image, from which on soft light's changes by many edits are computed on the light's
own grid, and nodes along the longest axis of a grid for smaller images. Its curves differ by 2 to
6 % in length, and in direction by a cosine of .9998, and take a fifth of the time."""

Device = Literal["cpu", "cuda"]


@dataclass(frozen=True)
class Frame:
    """One image and its depth.

    Attributes
    ----------
    rgba : ndarray of float32, shape (size, size, 4)
        In [0, 1]; colour premultiplied by opacity on black; row 0 at the top.
    depth : ndarray of float32, shape (size, size)
        Distance from the eye, in world units, at which the opacity reaches
        1/255; infinite where nothing is visible.
    """

    rgba: NDArray[np.float32]
    depth: NDArray[np.float32]


class RaycastRenderer:
    """Renders one volume under one lighting, on CPU threads or a GPU.

    Parameters
    ----------
    volume : Volume
        TFs lie over its scalar range, that of the voxels or a chosen one; what is interpolated
        beyond it looks as its ends do.
    lighting : {"none", "direct", "soft", "shadows"}
        Emission-absorption only, with gradient shading, with shadows and
        ambient light from a grid, or with a shadow of each sample.
    light : LightDirection, optional
        Default direction of the distant light relative to the view, for inputs
        without a light; ignored when unlit.
    sample_distance : float
        Default distance between samples along a ray, in voxels.
    threads : int, optional
        Number of CPU threads, one per processor by default.
    preintegrated : bool
        Whether to integrate the transfer functions over each step, so that narrow
        peaks between two samples are not missed; only for unlit scenes on the CPU.
    device : {"cpu", "cuda"}

    Attributes
    ----------
    skip_empty, terminate_early : bool
        Empty-space skipping and early ray termination, both enabled by default;
        can be disabled for measurements.

    Raises
    ------
    RenderError
        For unsupported combinations, or when no GPU is available.
    """

    def __init__(
        self,
        volume: Volume,
        lighting: Lighting = "none",
        light: LightDirection | None = None,
        sample_distance: float = 0.5,
        *,
        threads: int | None = None,
        preintegrated: bool = False,
        device: Device = "cpu",
    ) -> None:
        if lighting == "path":
            raise RenderError(
                "The ray caster has no path-traced light, nor sensitivities under it; "
                "choose another light."
            )
        if preintegrated and (lighting != "none" or device != "cpu"):
            raise RenderError(
                "Pre-integration is there for unlit scenes on the CPU only; "
                "turn it off, or the light."
            )
        self.sample_distance = sample_distance
        self.skip_empty = self.terminate_early = True
        self._volume = volume
        self._lighting = lighting
        self._light = light or LightDirection()
        self._preintegrated = preintegrated
        self._executor = ThreadPoolExecutor(
            threads or os.cpu_count() or 1, thread_name_prefix="raycast"
        )
        scalars, (lo, hi) = renderable_scalars(volume, NATIVE_TYPES)
        self._voxels = scalars.reshape(-1)
        hidden = volume.hidden
        self._missing = None if hidden is None else np.ravel(hidden).view(np.uint8)
        bins = (lo, (TF_SAMPLES - 1) / (hi - lo))
        # Samples are clamped to the tables, but segments between them may begin or end beyond.
        beyond = FARTHEST_LEVELS if preintegrated else 0
        self._scale = (
            np.float32(lo),
            np.float32(bins[1] * LEVELS_PER_BIN),
            np.float32(-beyond),
            np.float32(LEVELS - 1 + beyond),
        )
        reflects = lighting in ("direct", "shadows")
        self._noise = noise_of(scalars) if reflects else 0.0
        self._values = float(scalars.min()), float(scalars.max())
        self.cells = MinMaxCells(scalars, bins, self._executor, hidden)
        self._opacities = lru_cache(maxsize=4)(self._opacities_of)
        self._distances = lru_cache(maxsize=4)(self._distances_of)
        self._illumination: Illumination | None = None
        if lighting == "soft":
            light_grid = partial(
                Illumination, scalars, bins, volume, self._executor, missing=hidden
            )
            self._illumination = light_grid()
            self._coarse = lru_cache(lambda: light_grid(longest=COARSE_LIGHT))
        self._cuda = _gpu_painter(self._voxels) if device == "cuda" else None

    @property
    def is_differentiable(self) -> bool:
        """Whether the exact derivative is there: on the CPU."""
        return self._cuda is None and not self._preintegrated

    @property
    def differentiates_windows(self) -> bool:
        """Whether many windows are as fast as one; soft light is taken back for each of them."""
        return self._illumination is None

    @property
    def scalar_range(self) -> Range:
        """Range over which TFs lie: that of the voxels, or one chosen by ``Volume.over``."""
        return self._volume.scalar_range

    def render(
        self, inputs: SceneInputs, size: int | Raster, sample_distance: float | None = None
    ) -> NDArray[np.float32]:
        """Render one image.

        Parameters
        ----------
        inputs : SceneInputs
        size : int or Raster
            Width and height in pixels, or the pixels of a wider image or of a part.
        sample_distance : float, optional
            In voxels; the renderer's own by default.

        Returns
        -------
        ndarray of float32, shape (rows, columns, 4)
            RGBA in [0, 1]; colour premultiplied by opacity on black; row 0 at
            the top.
        """
        return self._draw(inputs, size, sample_distance)

    def frame(self, inputs: SceneInputs, size: int) -> Frame:
        """Render one image with the depth of the first visible sample in each pixel."""
        depth = np.empty((size, size), dtype=np.float32)
        return Frame(self._draw(inputs, size, depth=depth), depth)

    def opacity_image(self, inputs: SceneInputs, size: int) -> NDArray[np.float32]:
        """Render opacity only, as float32 (size, size) in [0, 1], row 0 at the top."""
        return self._draw(inputs, size, colored=False)[..., 0]

    def differentiate(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        windows: NDArray[np.int64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Differentiate windows of the image by the opacity TF.

        Parameters
        ----------
        inputs : SceneInputs
        size : int or Raster
            Width and height of the image in pixels, or the pixels of a wider one.
        windows : ndarray of int64, shape (n, 4)
            First row, row after the last, first column, column after the last.

        Returns
        -------
        gradients : ndarray of float64, shape (n, 256)
            Sum of I dI / dt over the window's pixels and colour channels, t
            being the TF's opacity (per voxel length) at 256 scalar values.
        energies : ndarray of float64, shape (n,)
            Sum of I squared over the window's pixels and colour channels.

        Raises
        ------
        RenderError
            With pre-integration or on a GPU.
        """
        if self._illumination is None:
            return self._differentiated(inputs, size, windows)[:2]
        parts = [self.differentiate_together(inputs, size, window[None]) for window in windows]
        gradients, energies = zip(*parts, strict=True)
        return np.stack(gradients), np.array(energies)

    def differentiate_together(
        self, inputs: SceneInputs, size: int | Raster, windows: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], float]:
        """Differentiate windows that are one region, whose derivatives are added up.

        Parameters
        ----------
        inputs, size, windows
            See :meth:`differentiate`. In soft light this is much faster than one by one.

        Returns
        -------
        gradient : ndarray of float64, shape (256,)
        energy : float

        Raises
        ------
        RenderError
            With pre-integration or on a GPU.
        """
        gradients, energies, by_light = self._differentiated(inputs, size, windows)
        gradient = gradients.sum(axis=0)
        if self._illumination is not None and by_light is not None:
            lit = self._light_inputs(inputs)
            gradient += self._illumination.pass_back(*lit, by_light, inputs.crop)
        return gradient, float(energies.sum())

    def _differentiated(
        self, inputs: SceneInputs, size: int | Raster, windows: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64] | None]:
        """Differentiate windows, and all of them by soft light at its nodes, if there is any."""
        # The kernels of sensitivities are imported by who wants them.
        from model.rendering.raycast.differentiation import differentiate_windows

        arguments = self._path_arguments(inputs, size)
        gradients = np.empty((len(windows), TF_SAMPLES))
        energies = np.empty(len(windows))
        by_light: list[NDArray[np.float64]] = []
        lit = self._illumination
        run: Any = differentiate_windows

        def task(part: slice) -> None:
            nodes = None if lit is None else np.zeros(lit.shape)
            flat = None if nodes is None else nodes.reshape(-1)
            run(*arguments, windows[part], gradients[part], energies[part], flat)
            if nodes is not None:
                by_light.append(nodes)

        self._divide(len(windows), task)
        gradients *= self._per_sample_derivative(inputs)
        return gradients, energies, np.sum(by_light, axis=0) if by_light else None

    def squared_changes(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        windows: NDArray[np.int64],
        edits: NDArray[np.floating],
    ) -> NDArray[np.float64]:
        """Sum of the squared changes of windows of the image by each of several edits.

        Parameters
        ----------
        inputs, size, windows
            See :meth:`differentiate`.
        edits : ndarray, shape (n, 256)
            Differences of opacity (per voxel length) over the scalar range. The edits that
            change one bin must follow one another, as those around increasing values do, and be
            no more than :data:`model.rendering.raycast.change_norms.BAND`.

        Returns
        -------
        ndarray of float64, shape (n,)
            Sum of dI squared over the windows' pixels and colour channels.

        Raises
        ------
        RenderError
            With pre-integration or on a GPU.
        """
        from model.rendering.raycast.change_norms import BAND, band_of, square_changes

        arguments = self._path_arguments(inputs, size)
        by_bin, begin = band_of(edits * self._per_sample_derivative(inputs))
        count = int(begin.max()) + BAND
        turns = None
        if self._illumination is not None:
            padded = np.zeros((max(count, len(edits)), TF_SAMPLES), dtype=np.float32)
            padded[: len(edits)] = edits
            is_fine = Raster.of(size).shorter >= FINE_FROM
            grid = self._illumination if is_fine else self._coarse()
            turns = grid.changes(*self._light_inputs(inputs), padded[:count], inputs.crop)
        parts: list[NDArray[np.float64]] = []
        run: Any = square_changes

        def task(part: slice) -> None:
            squares = np.empty(count)
            run(*arguments, by_bin, begin, turns, windows[part], squares)
            parts.append(squares)

        self._divide(len(windows), task)
        return np.asarray(np.sum(parts, axis=0)[: len(edits)])

    def change(
        self, inputs: SceneInputs, size: int | Raster, edit: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Change of the image per unit of an edit of the opacity TF: its exact derivative.

        Parameters
        ----------
        inputs : SceneInputs
        size : int or Raster
            Width and height of the image in pixels, or the pixels of a wider one.
        edit : ndarray, shape (256,)
            Differences of opacity (per voxel length) over the scalar range.

        Returns
        -------
        ndarray of float32, shape (rows, columns, 3)

        Raises
        ------
        RenderError
            With pre-integration or on a GPU.
        """
        from model.rendering.raycast.tangents import change_rows

        self._check_differentiable()
        distance, volume, raster = self.sample_distance, self._volume, Raster.of(size)
        changes = level_table(edit * self._per_sample_derivative(inputs))
        shown = self._opacities(inputs.opacity_tf, distance) + abs(changes)
        image = np.empty((*raster.shape, 3), dtype=np.float32)
        glow, turn = self._glow(inputs, distance), None
        if self._illumination is not None and glow is not None:
            edits = np.asarray(edit, dtype=np.float32)[None]
            turn = self._illumination.changes(*self._light_inputs(inputs), edits, inputs.crop)
            turn = turn._replace(grid=turn.grid.reshape(-1))
        arguments = (
            self._voxels,
            volume.dimensions,
            self._scale,
            self._missing,
            self._distances_to(shown, distance, self.skip_empty),
            self.cells.shape,
            SHIFT,
            self._opacities(inputs.opacity_tf, distance),
            changes,
            color_table(inputs.color_tf, volume.scalar_range),
            self._gradient_light(inputs, distance),
            glow,
            turn,
            self._shadows(inputs, distance),
            np.float32(least_transparency(distance)),
            self._camera(inputs, raster),
            distance * volume.voxel_size,
        )
        self._run(change_rows, arguments, image)
        return image

    def visibility(
        self, inputs: SceneInputs, size: int | Raster, windows: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Sum of T_i a_i over the samples of windows at each of 256 scalar values.

        It does not depend on the lighting.

        Parameters
        ----------
        inputs, size, windows
            See :meth:`differentiate`.

        Returns
        -------
        ndarray of float64, shape (256,)
            They add up to the sum of the windows' opacities.
        """
        from model.rendering.raycast.tangents import add_visibility

        distance, volume, raster = self.sample_distance, self._volume, Raster.of(size)
        arguments = (
            *self._voxels_and_cells(inputs.opacity_tf, distance),
            self._opacities(inputs.opacity_tf, distance),
            self._camera(inputs, raster),
            distance * volume.voxel_size,
            raster.columns,
        )
        parts: list[NDArray[np.float64]] = []
        run: Any = add_visibility

        def task(part: slice) -> None:
            visible = np.zeros(TF_SAMPLES)
            run(*arguments, windows[part], visible)
            parts.append(visible)

        self._divide(len(windows), task)
        return np.asarray(np.sum(parts, axis=0))

    def value_visibility(
        self, inputs: SceneInputs, size: int | Raster, weights: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Sum of T_i a_i w_i over the samples of each pixel: how much of it shows some values.

        It does not depend on the lighting.

        Parameters
        ----------
        inputs, size
            See :meth:`render`.
        weights : ndarray, shape (256,)
            Of the scalar values, 0 to 1.

        Returns
        -------
        ndarray of float32, shape (rows, columns)
            With weights of 1 it is the pixels' opacity.
        """
        gray = [(float(w),) * 3 for w in np.clip(weights, 0.0, 1.0)]
        places = np.linspace(*self._volume.scalar_range, TF_SAMPLES).tolist()
        # The ends of a range are exact.
        places[0], places[-1] = self._volume.scalar_range
        stops = tuple((at, *color) for at, color in zip(places, gray, strict=True))
        shown = replace(inputs, color_tf=ColorTF(self._volume.scalar_range, stops))
        return np.ascontiguousarray(self._draw(shown, size, lit=False)[..., 0])

    def close(self) -> None:
        """End the threads; the renderer cannot be used afterwards."""
        self._executor.shutdown()

    def _draw(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        depth: NDArray[np.float32] | None = None,
        colored: bool = True,
        lit: bool = True,
    ) -> NDArray[np.float32]:
        distance = sample_distance or self.sample_distance
        raster = Raster.of(size)
        image = np.empty((*raster.shape, 4 if colored else 1), dtype=np.float32)
        volume = self._volume
        arguments = (
            *self._voxels_and_cells(inputs.opacity_tf, distance),
            *self._tables(inputs, distance, colored, lit),
            np.float32(LARGEST_ERROR / 2 if self.terminate_early else 0),
            self._camera(inputs, raster),
            distance * volume.voxel_size,
        )
        if self._cuda is not None:
            self._cuda.draw(arguments, image, depth)
        elif self._preintegrated:
            self._run(draw_rows_preintegrated, arguments, image, depth)
        else:
            # In shadows, samples are part of the light, and far apart.
            close = distance <= CLOSE and self._lighting != "shadows"
            self._run(draw_rows, arguments, image, depth, True if close else None)
        # Specular highlights may exceed 1.
        return np.clip(image, 0, 1, out=image)

    def _run(
        self,
        draw: Any,
        arguments: tuple[Any, ...],
        image: NDArray[np.float32],
        *others: Any,
    ) -> None:
        """Fill an image on this renderer's threads, a few rows at a time."""
        size = len(image)

        def task(row: int) -> None:
            draw(*arguments, (row, min(row + ROWS_PER_TASK, size)), image, *others)

        list(self._executor.map(task, range(0, size, ROWS_PER_TASK)))

    def _tables(
        self, inputs: SceneInputs, distance: float, colored: bool, lit: bool
    ) -> tuple[Any, ...]:
        """Look-up tables and light, as arguments of the drawing kernels."""
        scalar_range = self._volume.scalar_range
        opacity_tf, color_tf = inputs.opacity_tf, inputs.color_tf
        if self._preintegrated:
            table = preintegrated_table(
                opacity_tf, color_tf if colored else None, scalar_range, distance
            )
            return (table,)
        alphas = self._opacities(opacity_tf, distance)
        if not colored:
            return alphas, None, None, None, None
        light = self._gradient_light(inputs, distance) if lit else None
        glow = None
        shadows = self._shadows(inputs, distance) if lit else None
        if lit:
            glow = self._glow(inputs, distance)
        return alphas, color_table(color_tf, scalar_range, alphas), light, glow, shadows

    def _camera(self, inputs: SceneInputs, raster: Raster) -> NDArray[np.float64]:
        return camera_array(inputs.view, self._volume, raster, inputs.crop)

    def _gradient_light(self, inputs: SceneInputs, distance: float) -> Light | None:
        """Parameters of gradient shading; None where surfaces reflect nothing."""
        if self._lighting not in ("direct", "shadows"):
            return None
        light = inputs.light or self._light
        dim = self._dim(self._opacities(inputs.opacity_tf, distance), distance)
        return gradient_light(inputs.view, light, self._volume, inputs.crop, self._noise, dim)

    def _dim(self, opacity: NDArray[np.float32], distance: float) -> float:
        """How bright a pixel can be, 0 to 1, with these opacities of samples."""
        samples = 2 * self._volume.radius / (distance * self._volume.voxel_size)
        return min(1.0, samples * float(opacity.max()))

    def _shadows(self, inputs: SceneInputs, distance: float) -> Shadows | None:
        """Parameters of shadow rays; None where there are none."""
        if self._lighting != "shadows":
            return None
        step, light = distance * self._volume.voxel_size, inputs.light or self._light
        return shadow_rays(inputs.view, light, self._volume, step, self._values)

    def _glow(self, inputs: SceneInputs, distance: float) -> LightGrid | None:
        """Soft light; None under another one."""
        if self._illumination is None:
            return None
        dim = self._dim(self._opacities(inputs.opacity_tf, distance), distance)
        return self._illumination.grid(*self._light_inputs(inputs), inputs.crop, dim)

    def _light_inputs(
        self, inputs: SceneInputs
    ) -> tuple[View, LightDirection, NDArray[np.float32]]:
        """What soft light depends on besides the crop box."""
        opacities = inputs.opacity_tf.sample(self._volume.scalar_range)
        return inputs.view, inputs.light or self._light, opacities

    def _divide(self, count: int, task: Callable[[slice], object]) -> None:
        """Call a task on this renderer's threads for all parts of `count` windows."""
        per_task = max(1, count // TASKS)
        parts = [slice(first, first + per_task) for first in range(0, count, per_task)]
        list(self._executor.map(task, parts))

    def _path_arguments(self, inputs: SceneInputs, size: int | Raster) -> tuple[Any, ...]:
        """First arguments of the kernels that look at all samples along a ray."""
        self._check_differentiable()
        volume, distance, raster = self._volume, self.sample_distance, Raster.of(size)
        step = distance * volume.voxel_size
        return (
            *self._voxels_and_cells(inputs.opacity_tf, distance),
            self._opacities(inputs.opacity_tf, distance),
            color_table(inputs.color_tf, volume.scalar_range),
            self._gradient_light(inputs, distance),
            self._glow(inputs, distance),
            self._shadows(inputs, distance),
            np.float32(least_transparency(distance)),
            self._camera(inputs, raster),
            step,
            raster.columns,
            int(2 * volume.radius / step) + 2,
        )

    def _per_sample_derivative(self, inputs: SceneInputs) -> NDArray[np.float64]:
        """Derivative of a sample's opacity by the TF's, at each bin."""
        opacity = inputs.opacity_tf.sample(self._volume.scalar_range)
        return per_sample_derivative(opacity, self.sample_distance)

    def _check_differentiable(self) -> None:
        if not self.is_differentiable:
            raise RenderError(
                "The exact sensitivity is there on the CPU, without pre-integration; choose those."
            )

    def _voxels_and_cells(self, opacity_tf: OpacityTF, distance: float) -> tuple[Any, ...]:
        """First arguments of all kernels: the volume and the cells for empty-space skipping."""
        return (
            self._voxels,
            self._volume.dimensions,
            self._scale,
            self._missing,
            self._distances(opacity_tf, distance, self.skip_empty),
            self.cells.shape,
            SHIFT,
        )

    def _opacities_of(self, opacity_tf: OpacityTF, sample_distance: float) -> NDArray[np.float32]:
        """Opacity of a sample at each level."""
        return opacity_table(opacity_tf, self._volume.scalar_range, sample_distance)

    def _distances_of(
        self, opacity_tf: OpacityTF, sample_distance: float, skip_empty: bool
    ) -> NDArray[np.int8]:
        """Distance of each cell to the nearest visible one; zeros without empty-space skipping."""
        opacity = self._opacities(opacity_tf, sample_distance)
        return self._distances_to(opacity, sample_distance, skip_empty)

    def _distances_to(
        self, opacity: NDArray[np.float32], sample_distance: float, skip_empty: bool
    ) -> NDArray[np.int8]:
        """Return the same for the opacities of all levels."""
        if not skip_empty:
            return np.zeros(np.prod(self.cells.shape), dtype=np.int8)
        volume = self._volume
        samples = 2 * volume.radius / (sample_distance * volume.voxel_size)
        # All skipped samples of a ray together must stay below the largest error, or that share
        # of the brightest pixel that a nearly transparent TF can make.
        brightest = self._dim(opacity, sample_distance)
        shown = opacity > brightest * LARGEST_ERROR / 2 / samples
        in_bin = np.zeros(TF_SAMPLES, dtype=bool)
        # Levels between two bins count for both.
        level = np.flatnonzero(shown)
        in_bin[level // LEVELS_PER_BIN] = True
        in_bin[-(-level // LEVELS_PER_BIN)] = True
        return self.cells.distances(in_bin)


def _gpu_painter(voxels: NDArray[Any]) -> Painter:
    # Late: who draws on the CPU does without 130 modules of Numba's and 8 MB.
    from model.rendering.raycast.cuda import Painter

    return Painter(voxels)
