"""The ray caster as a renderer, with depth and exact derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError
from model.measurements import processors
from model.rendering.opacity_correction import least_transparency
from model.rendering.raster import Raster, blur_of
from model.rendering.raycast.batch import CLOSE
from model.rendering.raycast.cells import SHIFT, MinMaxCells
from model.rendering.raycast.classification import (
    LARGEST_ERROR,
    LEVELS_PER_BIN,
    Classification,
    Classifier,
    color_table,
    level_table,
)
from model.rendering.raycast.illumination import (
    COARSE,
    LONGEST_AXIS,
    SHADOW,
    Illumination,
    SoftLight,
    gradient_light,
    node_distance,
    travel_direction,
)
from model.rendering.raycast.marching import draw_rows
from model.rendering.raycast.rays import Medium, camera_array
from model.rendering.raycast.shading import NO_GRID, NO_LIGHT, Light, LightGrid
from model.rendering.scalars import (
    KERNEL_TYPES,
    LABEL_NOISE,
    blurred,
    marks_of,
    masked_scalars,
    noise_of,
    renderable_scalars,
)
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.scene import LightDirection, Lighting
from model.scene.transfer_function import TF_SAMPLES, ColorTF, Range
from model.scene.volume import Volume

ROWS_PER_TASK = 8
TASKS = 32
"""Number of tasks that differentiated windows are divided into, to balance the threads' load."""

FINE_FROM = 128
"""Least size of an image, in pixels, for which changes of soft light by many edits are computed on
the light's own grid. Smaller ones use a coarse grid, in a fifth of the time: the curves' norms
differ by 2 to 6 %, and their cosine is .9998."""

NO_DEPTH = np.empty((0, 0), dtype=np.float32)
NO_NODES, NO_SQUARES = np.empty(0), np.empty(0)
NO_FADING, ONE = np.empty(0, dtype=np.float32), np.float32(1)
NO_CHANGES = NO_GRID._replace(grid=np.empty((0, 0), dtype=np.float32))
"""Arguments of kernels for what a scene does not have or what is not requested."""


class Shown(NamedTuple):
    """What depends on which voxels are shown."""

    scalars: NDArray[Any]
    marks: NDArray[np.uint8]
    cells: MinMaxCells
    classifier: Classifier
    illumination: Callable[[int], Illumination]
    """Soft light on a grid of so many nodes along its longest axis; the grids are kept."""


class KernelVoxels:
    """A volume's voxels as kernels take them; of what is shown, the whole and the newest mask's."""

    def __init__(self, volume: Volume, executor: Executor, is_blurred: bool = False) -> None:
        self._volume = volume
        scalars, (lo, hi) = renderable_scalars(volume, KERNEL_TYPES)
        self.scalars = scalars = blurred(scalars) if is_blurred else scalars
        bins = lo, (TF_SAMPLES - 1) / (hi - lo)
        self.width = hi - lo
        self._scale = np.float32(lo), np.float32(bins[1] * LEVELS_PER_BIN)

        # Without `self`: a reference cycle would keep the voxels alive.
        def under(mask: Mask | None) -> Shown:
            marks, drawn = marks_of(volume, mask), masked_scalars(scalars, volume, mask)
            hidden = volume.hidden if mask is None else marks.reshape(scalars.shape) > 0
            cells = MinMaxCells(drawn, bins, executor, hidden)

            def lit(longest: int) -> Illumination:
                return Illumination(drawn, bins, volume, executor, longest, hidden)

            return Shown(drawn, marks, cells, Classifier(volume, cells, mask), lru_cache(lit))

        self.under = lru_cache(maxsize=2)(under)

    def medium(
        self, inputs: SceneInputs, opacity: NDArray[np.float32], cells: NDArray[np.int8]
    ) -> Medium:
        """Return the volume for kernels: with samples' opacities, and cells that are visible."""
        shown = self.under(inputs.mask)
        return Medium(
            shown.scalars.reshape(-1),
            self._volume.dimensions,
            self._scale,
            shown.marks,
            cells,
            shown.cells.shape,
            SHIFT,
            opacity,
            inputs.is_nearest(self._volume),
            np.float32(0),
            np.float32(0),
        )


class RaycastRenderer:
    """Renders one volume under no, direct or soft light, on CPU threads.

    The light is that of inputs without one. Distances between samples are in voxels; there is a
    thread per processor by default. `shadow` is the share of extinction that attenuates soft light.
    `is_blurred` draws and differentiates blurred voxels, except of labels.
    `skip_empty` and `terminate_early` can be switched off for measurements.
    """

    def __init__(
        self,
        volume: Volume,
        lighting: Lighting = "none",
        light: LightDirection | None = None,
        sample_distance: float = 0.5,
        *,
        threads: int | None = None,
        shadow: float = SHADOW,
        is_blurred: bool = False,
    ) -> None:
        if lighting == "path":
            raise RenderError(
                "The ray caster has no path-traced light, nor sensitivities under it; "
                "choose another light."
            )
        self.sample_distance = sample_distance
        self.skip_empty = self.terminate_early = True
        self._go_on: Callable[[], object] = lambda: None
        self._volume = volume
        self._lighting, self._default = lighting, light or LightDirection()
        self._shadow = shadow
        threads = threads or processors()
        self._executor = ThreadPoolExecutor(threads, thread_name_prefix="raycast")
        self._is_blurred = is_blurred and not volume.file.is_labels
        self._voxels = lru_cache(partial(KernelVoxels, volume, self._executor))
        self._noise = noise_of(self._voxels(False).scalars) if lighting == "direct" else 0.0
        self._is_coarsely_lit = False
        self.differentiates_windows = lighting != "soft"
        """Whether many windows are as fast as one; soft light needs an adjoint sweep for each."""
        # What the first image needs is made before it.
        first = self._voxels(self._is_blurred).under(None)
        if lighting == "soft":
            first.illumination(LONGEST_AXIS)

    @property
    def scalar_range(self) -> Range:
        """Range over which TFs lie: that of the voxels, or one chosen by ``Volume.over``."""
        return self._volume.scalar_range

    @contextmanager
    def asking(
        self, go_on: Callable[[], object] | None = None, is_coarsely_lit: bool = False
    ) -> Iterator[None]:
        """Have `go_on` called before each part of computations within; it may raise to cancel.

        Coarse lighting is for moving images: a coarse grid of soft light takes an eighth of the
        time, and normals without blur half.
        """
        before = self._go_on, self._is_coarsely_lit
        self._go_on, self._is_coarsely_lit = go_on or self._go_on, is_coarsely_lit
        try:
            yield
        finally:
            self._go_on, self._is_coarsely_lit = before

    def render(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        *,
        go_on: Callable[[], object] | None = None,
    ) -> NDArray[np.float32]:
        """Render one image; see :class:`model.rendering.renderer.Renderer`."""
        with self.asking(go_on, self._is_coarsely_lit):
            return self._draw(inputs, size, sample_distance)

    def frame(
        self, inputs: SceneInputs, size: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Render one image, and the distance from the eye in world units at which it is visible.

        Pixels are visible from an opacity of 1/255 on; the distance is infinite where none is.
        """
        depth = np.empty((size, size), dtype=np.float32)
        return self._draw(inputs, size, depth=depth), depth

    def differentiate(
        self, inputs: SceneInputs, size: int | Raster, windows: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Differentiate windows (n, 4) of the image by the opacity TF.

        Each window has its first row, row after the last, first column and column after the last.
        Returns gradients (n, 256), the sums of I dI / dt over a window's pixels and colour
        channels, t being the TF's opacity (per voxel length) at 256 scalar values; and energies
        (n,), the sums of I squared.
        """
        if self.differentiates_windows:
            return self._differentiated(inputs, size, windows)[:2]
        parts = [self.differentiate_together(inputs, size, window[None]) for window in windows]
        gradients, energies = zip(*parts, strict=True)
        return np.stack(gradients), np.array(energies)

    def differentiate_together(
        self, inputs: SceneInputs, size: int | Raster, windows: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], float]:
        """Sum the derivatives (256,), and the energies, of windows that are one region.

        See :meth:`differentiate`; in soft light this is much faster than one by one.
        """
        gradients, energies, by_light = self._differentiated(inputs, size, windows)
        gradient = gradients.sum(axis=0)
        if (grid := self._light_grid(inputs)) is not None:
            gradient += grid.pass_back(self._soft_light(inputs, Raster.of(size)), by_light)
        return gradient, float(energies.sum())

    def _differentiated(
        self, inputs: SceneInputs, size: int | Raster, windows: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Differentiate windows, and all of them by soft light at each of its nodes."""
        # Imported here: only sensitivities need these kernels.
        from model.rendering.raycast.differentiation import Edits, band_of, differentiate_windows

        arguments = self._path_arguments(inputs, size)
        gradients = np.empty((len(windows), TF_SAMPLES))
        energies = np.empty(len(windows))
        unedited = Edits(*band_of(np.zeros((1, TF_SAMPLES))), NO_CHANGES), NO_SQUARES
        grid = self._light_grid(inputs)
        shape = (0, 0, 0) if grid is None else grid.shape

        def add(part: slice, nodes: NDArray[np.float64]) -> None:
            found = gradients[part], energies[part], nodes
            differentiate_windows(*arguments, windows[part], *found, *unedited)

        by_light = self._sum(len(windows), math.prod(shape), add).reshape(shape)
        if inputs.mask is None:
            gradients *= self._classified(inputs).derivative
        return gradients, energies, by_light

    def squared_changes(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        windows: NDArray[np.int64],
        edits: NDArray[np.floating],
    ) -> NDArray[np.float64]:
        """Sum of the squared changes (n,) of windows of the image by edits (n, 256).

        Edits are differences of opacity (per voxel length) over the scalar range; those that change
        one bin must follow one another, and be no more than :data:`differentiation.BAND`.
        """
        from model.rendering.raycast import differentiation as kernels

        arguments = self._path_arguments(inputs, size)
        slopes = self._classified(inputs).derivative if inputs.mask is None else 1
        by_bin, begin = kernels.band_of(edits * slopes)
        count = max(int(begin.max()) + kernels.BAND, len(edits))
        turns, raster = NO_CHANGES, Raster.of(size)
        is_coarse = raster.shorter < FINE_FROM
        if (grid := self._light_grid(inputs, is_coarse)) is not None:
            padded = np.zeros((count, TF_SAMPLES), dtype=np.float32)
            padded[: len(edits)] = edits
            turns = grid.changes(self._soft_light(inputs, raster), padded)

        def add(part: slice, squares: NDArray[np.float64]) -> None:
            shown = windows[part]
            unused = np.empty((len(shown), TF_SAMPLES)), np.empty(len(shown)), NO_NODES
            edited = kernels.Edits(by_bin, begin, turns)
            kernels.differentiate_windows(*arguments, shown, *unused, edited, squares)

        return self._sum(len(windows), count, add)[: len(edits)]

    def change(
        self, inputs: SceneInputs, size: int | Raster, edit: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Exact derivative (rows, columns, 3) of the image by an edit of the opacity TF.

        The edit (256,) is a difference of opacity (per voxel length) over the scalar range.
        """
        from model.rendering.raycast.tangents import change_rows

        distance, volume, raster = self.sample_distance, self._volume, Raster.of(size)
        classified = self._classified(inputs)
        changes = level_table(edit * classified.derivative)
        classifier = self._voxels_of(inputs).under(inputs.mask).classifier
        shown = classified.opacity + abs(changes)
        cells = classifier.cells_around(shown, distance, self.skip_empty)
        light, glow = self._lit(inputs, raster, classified)
        turn = NO_GRID
        if (grid := self._light_grid(inputs)) is not None:
            edits = np.asarray(edit, dtype=np.float32)[None]
            turn = grid.changes(self._soft_light(inputs, raster), edits)
            turn = turn._replace(grid=turn.grid.reshape(-1))
        arguments = (
            self._medium(inputs, raster, classified)._replace(cells=cells),
            changes,
            color_table(inputs.color_tf, volume.scalar_range),
            light or NO_LIGHT,
            glow or NO_GRID,
            turn,
            np.float32(least_transparency(distance)),
            self._camera(inputs, raster),
            distance * volume.voxel_size,
        )
        image = np.empty((*raster.shape, 3), dtype=np.float32)
        self._run(change_rows, arguments, image)
        return image

    def visibility(
        self, inputs: SceneInputs, size: int | Raster, windows: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Sum of T_i a_i over the samples of windows at each of 256 scalar values.

        Whatever the light, they add up to the sum of the windows' opacities.
        """
        from model.rendering.raycast.tangents import add_visibility

        distance, volume, raster = self.sample_distance, self._volume, Raster.of(size)
        classified = self._classified(inputs)
        arguments = (
            self._medium(inputs, raster, classified),
            self._camera(inputs, raster),
            distance * volume.voxel_size,
            raster.columns,
        )

        def add(part: slice, visible: NDArray[np.float64]) -> None:
            add_visibility(*arguments, windows[part], visible)

        return self._sum(len(windows), TF_SAMPLES, add)

    def value_visibility(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        weights: NDArray[np.floating],
        sample_distance: float | None = None,
    ) -> NDArray[np.float32]:
        """Share of each pixel that shows some values, in any light: the sum of T_i a_i w_i.

        The weights (256,) are in [0, 1]; all 1 give the opacity (rows, columns). Sparse samples
        miss narrow bands of values at surfaces, which shows as rings.
        """
        gray = [(float(w),) * 3 for w in np.clip(weights, 0.0, 1.0)]
        places = np.linspace(*self._volume.scalar_range, TF_SAMPLES).tolist()
        # The ends of a range are exact.
        places[0], places[-1] = self._volume.scalar_range
        stops = tuple((at, *color) for at, color in zip(places, gray, strict=True))
        shown = replace(inputs, color_tf=ColorTF(self._volume.scalar_range, stops))
        return np.ascontiguousarray(self._draw(shown, size, sample_distance, lit=False)[..., 0])

    def close(self) -> None:
        """End the threads; the renderer cannot be used afterwards."""
        self._executor.shutdown()

    def _draw(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        depth: NDArray[np.float32] = NO_DEPTH,
        lit: bool = True,
    ) -> NDArray[np.float32]:
        distance = sample_distance or self.sample_distance
        raster = Raster.of(size)
        image = np.empty((*raster.shape, 4), dtype=np.float32)
        volume, classified = self._volume, self._classified(inputs, distance)
        arguments = (
            self._medium(inputs, raster, classified),
            color_table(inputs.color_tf, volume.scalar_range, classified.opacity),
            *(self._lit(inputs, raster, classified) if lit else (None, None)),
            np.float32(LARGEST_ERROR / 2 if self.terminate_early else 0),
            self._camera(inputs, raster),
            distance * volume.voxel_size,
        )
        is_close = distance <= CLOSE and not inputs.is_nearest(volume)
        self._run(draw_rows, arguments, image, depth, is_close)
        # Specular highlights may exceed 1.
        return np.clip(image, 0, 1, out=image)

    def _run(
        self, draw: Any, arguments: tuple[Any, ...], image: NDArray[np.float32], *others: Any
    ) -> None:
        """Fill an image on this renderer's threads, a few rows at a time."""
        size, go_on = len(image), self._go_on

        def task(row: int) -> None:
            go_on()
            draw(*arguments, (row, min(row + ROWS_PER_TASK, size)), image, *others)

        list(self._executor.map(task, range(0, size, ROWS_PER_TASK)))

    def _medium(self, inputs: SceneInputs, raster: Raster, classified: Classification) -> Medium:
        """Return the volume for kernels: at rest, normals of large voxels are blurred."""
        medium = self._voxels_of(inputs).medium(inputs, classified.opacity, classified.cells)
        blur = 0.0 if self._is_coarsely_lit else blur_of(inputs.view, self._volume, raster)
        return medium._replace(blur=np.float32(blur))

    def _voxels_of(self, inputs: SceneInputs) -> KernelVoxels:
        return self._voxels(self._is_blurred and not inputs.is_nearest(self._volume))

    def _camera(self, inputs: SceneInputs, raster: Raster) -> NDArray[np.float64]:
        return camera_array(inputs.view, self._volume, raster, inputs.part)

    def _sum(
        self, windows: int, size: int, add: Callable[[slice, NDArray[np.float64]], object]
    ) -> NDArray[np.float64]:
        """Sum arrays of a size that a task on this renderer's threads adds parts of windows to."""
        per_task, go_on = max(1, windows // TASKS), self._go_on
        parts = [slice(first, first + per_task) for first in range(0, windows, per_task)]

        def task(part: slice) -> NDArray[np.float64]:
            go_on()
            total = np.zeros(size)
            add(part, total)
            return total

        return np.asarray(sum(self._executor.map(task, parts), np.zeros(size)))

    def _path_arguments(self, inputs: SceneInputs, size: int | Raster) -> tuple[Any, ...]:
        """First arguments of the kernels that look at all samples along a ray."""
        volume, distance, raster = self._volume, self.sample_distance, Raster.of(size)
        step = distance * volume.voxel_size
        classified = self._classified(inputs)
        light, glow = self._lit(inputs, raster, classified)
        return (
            self._medium(inputs, raster, classified),
            color_table(inputs.color_tf, volume.scalar_range),
            light or NO_LIGHT,
            glow or NO_GRID,
            NO_FADING if inputs.mask is None else np.append(np.float32(classified.derivative), ONE),
            np.float32(least_transparency(distance)),
            self._camera(inputs, raster),
            step,
            raster.columns,
            int(2 * volume.radius / step) + 2,
        )

    def _classified(self, inputs: SceneInputs, distance: float | None = None) -> Classification:
        """Classify the samples under a scene's TF; the renderer's own distance by default."""
        apart = distance or self.sample_distance
        classifier = self._voxels_of(inputs).under(inputs.mask).classifier
        return classifier.classified(inputs.opacity_tf, apart, self.skip_empty)

    def _lit(
        self, inputs: SceneInputs, raster: Raster, classified: Classification
    ) -> tuple[Light | None, LightGrid | None]:
        """Return a scene's light on surfaces by their gradient, and soft light; None without it."""
        if self._lighting == "direct":
            noise = LABEL_NOISE if inputs.is_nearest(self._volume) else self._noise
            travel = travel_direction(inputs.view, inputs.light or self._default)
            surface = self._volume, inputs.part, noise, classified.brightest
            return gradient_light(travel, *surface), None
        if (grid := self._light_grid(inputs)) is not None:
            return None, grid.grid(self._soft_light(inputs, raster), classified.brightest)
        return None, None

    def _light_grid(self, inputs: SceneInputs, is_coarse: bool = False) -> Illumination | None:
        """Return the grid of soft light in a scene's voxels; None under another light."""
        if self._lighting != "soft":
            return None
        longest = COARSE if is_coarse or self._is_coarsely_lit else LONGEST_AXIS
        return self._voxels_of(inputs).under(inputs.mask).illumination(longest)

    def _soft_light(self, inputs: SceneInputs, raster: Raster) -> SoftLight:
        travel = travel_direction(inputs.view, inputs.light or self._default)
        opacities = inputs.opacity_tf.sample(self._volume.scalar_range)
        # Half of a normal's: at nodes, these are a cubic B-spline's shares. Also of a coarse grid.
        blur = blur_of(inputs.view, self._volume, raster, node_distance(self._volume)) / 2
        return SoftLight(travel, opacities, inputs.part, blur, self._shadow)
