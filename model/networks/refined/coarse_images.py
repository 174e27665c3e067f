"""Images of a coarse volume under the true transfer functions, differentiable by these."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from model.networks.refined.coarse_cells import SHIFT, CoarseCells
from model.networks.refined.coarse_kernels import ENTRIES, draw, pull_back, push_forward
from model.networks.refined.coarse_volume import CoarseVolume
from model.rendering.raycast.camera import camera_array
from model.rendering.raycast.illumination import Illumination, gradient_light
from model.rendering.raycast.renderer import LARGEST_ERROR, ROWS_PER_TASK
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.view import View

STEP = 0.7
"""Distance between samples, in distances between nodes."""

SHADOW_NODES, AMBIENT_NODES = 64, 32
"""Nodes along the longest axis of the light grid: as many as the ray caster's, but for ambient
light, which is 14 fifteenths of the work and needs fewer."""

Images = NDArray[np.float32]
Rows = tuple[int, int]


class Shot(NamedTuple):
    """One image to draw: view, light if there is any, and the opacity TF that shadows follow.

    Attributes
    ----------
    view : View
    light : LightDirection or None
    opacities : ndarray of float32, shape (256,)
    """

    view: View
    light: LightDirection | None
    opacities: NDArray[np.float32]


class CoarseRenderer:
    """Draws a coarse volume for tables of :func:`model.networks.refined.coarse_tables.entry_table`.

    Parameters
    ----------
    coarse : CoarseVolume
    lighting : {"none", "direct", "global"}
        Under light, a second, lit image follows the unlit one. Global light is the ray
        caster's, whatever the scene's renderer.
    sample_distance : float
        Distance between samples in a volume that is kept whole, in voxels: that of the
        images to be met, as then the same samples are taken.

    Attributes
    ----------
    distance : float
        Distance between samples, in voxels of the volume.
    channels : int
        Channels of an image: RGBA, under light twice.
    """

    def __init__(
        self,
        coarse: CoarseVolume,
        lighting: Lighting = "none",
        sample_distance: float = 0.5,
    ) -> None:
        self._step = STEP * coarse.node_size
        if coarse.is_whole:
            self._step = sample_distance * coarse.voxel_size
        self.distance = self._step / coarse.voxel_size
        self.channels = 4 if lighting == "none" else 8
        self._coarse = coarse
        self._lighting = lighting
        self._longest = int(2 * coarse.radius / self._step) + 2
        means = np.ascontiguousarray(coarse.means)
        self._means = means.reshape(-1)
        self._nodes = (256 * coarse.spreads.astype(np.uint16) ** 2 + means).reshape(-1)
        # All skipped samples of a ray together must stay below the largest error.
        self._cells = CoarseCells(coarse, LARGEST_ERROR / 2 / self._longest)
        self._illumination = (
            Illumination(means, (0.0, 1.0), coarse, _threads(), SHADOW_NODES, AMBIENT_NODES)
            if lighting == "global"
            else None
        )

    def draw(self, tables: Images, shots: Sequence[Shot], size: int) -> Images:
        """Draw images.

        Parameters
        ----------
        tables : ndarray of float32, shape (N, ENTRIES + 1, 4)
        shots : sequence of Shot
        size : int
            Width and height in pixels.

        Returns
        -------
        ndarray of float32, shape (N, channels, size, size)
        """
        images = np.empty((len(shots), self.channels // 4, size, size, 4), dtype=np.float32)
        tasks = []
        for table, shot, image in zip(tables, shots, images, strict=True):
            opacities = np.ascontiguousarray(table[:, 3])
            distances = self._cells.distances(opacities)
            skipping = distances, self._cells.shape, SHIFT
            arguments = (*self._volume, *skipping, table.reshape(-1), opacities, *self._place(shot))
            transparent = np.float32(LARGEST_ERROR / 2)
            tasks += [(draw, *arguments, transparent, rows, image) for rows in _tasks(size)]
        _run(tasks)
        return _channels_first(images)

    def pull_back(self, tables: Images, shots: Sequence[Shot], gradients: Images) -> Images:
        """Multiply a gradient by the Jacobian of :meth:`draw`.

        Parameters
        ----------
        tables : ndarray of float32, shape (N, ENTRIES + 1, 4)
        shots : sequence of Shot
        gradients : ndarray of float32, shape (N, channels, size, size)
            By the images.

        Returns
        -------
        ndarray of float32, shape (N, ENTRIES + 1, 4)
            By the tables. Shadows count as constant.
        """
        size = gradients.shape[2]
        by_image = np.ascontiguousarray(
            gradients.reshape(len(shots), -1, 4, size, size).transpose(0, 1, 3, 4, 2)
        )
        bounds = np.linspace(0, size, torch.get_num_threads() + 1).astype(int).tolist()
        sums = np.zeros((len(shots), len(bounds) - 1, ENTRIES + 1, 4))
        tasks = []
        for table, shot, gradient, parts in zip(tables, shots, by_image, sums, strict=True):
            arguments = (*self._volume, table.reshape(-1), *self._place(shot), self._longest)
            tasks += [
                (pull_back, *arguments, rows, gradient, part)
                for rows, part in zip(pairwise(bounds), parts, strict=True)
            ]
        _run(tasks)
        # In a fixed order, so that it can be repeated bit for bit.
        return np.asarray(sums.sum(axis=1), dtype=np.float32)

    def push_forward(
        self, tables: Images, changes: Images, shots: Sequence[Shot], size: int
    ) -> Images:
        """Multiply the Jacobian of :meth:`draw` by changes of the tables.

        Parameters
        ----------
        tables, changes : ndarray of float32, shape (N, ENTRIES + 1, 4)
        shots : sequence of Shot
        size : int

        Returns
        -------
        ndarray of float32, shape (N, channels, size, size)
            Changes of the images. Shadows count as constant.
        """
        images = np.empty((len(shots), self.channels // 4, size, size, 4), dtype=np.float32)
        tasks = []
        for table, change, shot, image in zip(tables, changes, shots, images, strict=True):
            arguments = (*self._volume, table.reshape(-1), change.reshape(-1), *self._place(shot))
            tasks += [(push_forward, *arguments, rows, image) for rows in _tasks(size)]
        _run(tasks)
        return _channels_first(images)

    @property
    def _volume(self) -> tuple[Any, ...]:
        return self._nodes, self._means, self._coarse.dimensions

    def _place(self, shot: Shot) -> tuple[Any, ...]:
        """Light, shadows, camera and step of a shot, as arguments of the kernels."""
        light = glow = None
        direction = shot.light or LightDirection()
        if self._lighting == "direct":
            light = gradient_light(shot.view, direction, self._coarse)
        if self._illumination is not None:
            glow = self._illumination.grid(shot.view, direction, shot.opacities)
        return light, glow, camera_array(shot.view, self._coarse), self._step


class CoarseImages(torch.autograd.Function):
    """:meth:`CoarseRenderer.draw` for tensors, differentiable backward and forward."""

    @staticmethod
    def forward(
        tables: Tensor, renderer: CoarseRenderer, shots: Sequence[Shot], size: int
    ) -> Tensor:
        """Draw images (N, channels, size, size) of tables (N, ENTRIES + 1, 4)."""
        return torch.from_numpy(renderer.draw(_array(tables), shots, size)).to(tables)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        """Keep the arguments for the derivatives."""
        tables, ctx.renderer, ctx.shots, ctx.size = inputs
        ctx.save_for_backward(tables)
        ctx.save_for_forward(tables)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None, None]:
        """Return the gradient by the tables."""
        (tables,) = ctx.saved_tensors
        found = ctx.renderer.pull_back(_array(tables), ctx.shots, _array(gradients[0]))
        return torch.from_numpy(found).to(tables), None, None, None

    @staticmethod
    def jvp(ctx: Any, *tangents: Any) -> Tensor:
        """Return the images' tangent."""
        (tables,) = ctx.saved_tensors
        found = ctx.renderer.push_forward(_array(tables), _array(tangents[0]), ctx.shots, ctx.size)
        return torch.from_numpy(found).to(tables)


def _array(tensor: Tensor) -> Images:
    array: Images = tensor.detach().to("cpu", torch.float32).contiguous().numpy()
    return array


def _channels_first(images: Images) -> Images:
    """Convert images (N, I, S, S, 4) to (N, 4 I, S, S)."""
    n, _, size, _, _ = images.shape
    return np.ascontiguousarray(images.transpose(0, 1, 4, 2, 3)).reshape(n, -1, size, size)


def _tasks(size: int) -> list[Rows]:
    return [(row, min(row + ROWS_PER_TASK, size)) for row in range(0, size, ROWS_PER_TASK)]


def _run(tasks: Iterable[tuple[Callable[..., None], *tuple[Any, ...]]]) -> None:
    """Call functions with their arguments, on all threads."""
    list(_threads().map(lambda task: task[0](*task[1:]), tasks))


@lru_cache(maxsize=1)
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(torch.get_num_threads(), thread_name_prefix="coarse-images")
