"""The ray caster on a GPU, with one thread per pixel."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numba import cuda, float32, int32
from numba.core import config
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.raycast.marching import march, show
from model.rendering.raycast.rays import make_ray

BLOCK = (8, 8)
"""Threads per block, along the columns and rows of the image."""

BATCH = 4
"""Number of samples that a GPU thread interpolates before compositing them."""


def is_available() -> bool:
    """Return True if there is a GPU that Numba can use.

    NVIDIA's numba-cuda is required: Numba's own CUDA target, which it replaces,
    is no longer maintained and cannot compile the ray caster.
    """
    maintained = getattr(cuda, "implementation", "") == "NVIDIA" or config.ENABLE_CUDASIM
    return bool(maintained and cuda.is_available())


@cuda.jit(fastmath=True)  # type: ignore[untyped-decorator]
def _draw_pixels(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    alphas: Any,
    colors: Any,
    light: Any,
    glow: Any,
    shadows: Any,
    opaque: Any,
    camera: Any,
    step: float,
    image: Any,
    depth: Any,
) -> None:
    """Draw one pixel; see :func:`model.rendering.raycast.cpu.draw_rows`."""
    column, row = cuda.grid(2)
    size = image.shape[1]
    if column >= size or row >= image.shape[0]:
        return
    levels, total = cuda.local.array(BATCH, int32), cuda.local.array(4, float32)
    scratch = cuda.local.array(BATCH, int32), cuda.local.array(BATCH + 1, float32)
    ray, distance = make_ray(camera, step, column, row, size)
    first = march(
        voxels, shape, scale, missing, cells, cell_shape, shift,
        alphas, colors, light, glow, shadows, ray, opaque, levels, None, total, scratch,
    )  # fmt: skip
    visible = distance + min(first, ray.last) * step if first >= 0 else np.inf
    show(image, depth, row, column, total, visible)


class _Nothing:
    """Numba extension that passes None to a kernel as a null pointer."""

    def prepare_args(self, kind: Any, value: Any, **_: Any) -> Any:
        # The simulator gives no kind, and accepts None.
        if value is None and kind is not None:
            return _draw_pixels.typeof_pyval(0), 0
        return kind, value


_draw_pixels.extensions.append(_Nothing())


class Painter:
    """Draws images of a volume that is kept in the GPU's memory.

    Parameters
    ----------
    voxels : ndarray, 1-D
        Scalars, x fastest.

    Raises
    ------
    RenderError
        When there is no GPU that Numba can use.
    """

    def __init__(self, voxels: NDArray[Any]) -> None:
        if not is_available():
            raise RenderError(
                "The ray caster finds no CUDA GPU here; render on the CPU, or install "
                "numba-cuda (pip install 'numba-cuda[cu12]') on a machine with an NVIDIA GPU."
            )
        # Each thread has its own current GPU, which is the first by default.
        self._gpu = cuda.gpus[_own_gpu()]
        with self._gpu:
            self._voxels = cuda.to_device(voxels)

    def draw(
        self,
        arguments: tuple[Any, ...],
        image: NDArray[np.float32],
        depth: NDArray[np.float32] | None,
    ) -> None:
        """Draw an image.

        Parameters
        ----------
        arguments : tuple
            Those of :func:`model.rendering.raycast.cpu.draw_rows` up to `step`.
        image : ndarray of float32, shape (rows, columns, channels)
            Output.
        depth : ndarray of float32, shape (size, size), or None
            Output.
        """
        rows, columns = image.shape[:2]
        blocks = (-(-columns // BLOCK[0]), -(-rows // BLOCK[1]))
        with self._gpu:
            on_device = [_to_device(argument) for argument in arguments[1:]]
            device_image = cuda.device_array(image.shape, image.dtype)
            device_depth = None if depth is None else cuda.device_array(depth.shape, depth.dtype)
            _draw_pixels[blocks, BLOCK](self._voxels, *on_device, device_image, device_depth)
            device_image.copy_to_host(image)
            if device_depth is not None:
                device_depth.copy_to_host(depth)


def _own_gpu() -> int:
    """Index of this process's GPU, from the local rank that torchrun assigns."""
    return int(os.environ.get("LOCAL_RANK", "0")) % len(cuda.gpus)


def _to_device(argument: Any) -> Any:
    """Copy an argument's arrays to the GPU's memory."""
    if isinstance(argument, np.ndarray):
        return cuda.to_device(argument)
    if hasattr(argument, "grid"):
        return argument._replace(grid=cuda.to_device(argument.grid))
    return argument
