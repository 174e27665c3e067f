"""The renderer's own sensitivity to the opacity TF: what a network's can be held against.

Sensitivity is the derivative of the l2 norm of an image region's colours by
the 256 values of the opacity TF (paper, Eq. 9, with the renderer in the place
of the network).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.raycast.renderer import RaycastRenderer
from model.transfer_function import TransferFunction
from model.view import View

BAND = 8
"""Rows of a region that one thread differentiates."""


@dataclass(frozen=True)
class Region:
    """A rectangle of pixels: left and top inside it, right and bottom just outside."""

    left: int
    top: int
    right: int
    bottom: int

    @classmethod
    def parse(cls, text: str) -> Region:
        """Read ``"LEFT,TOP,RIGHT,BOTTOM"``."""
        try:
            return cls(*(int(part) for part in text.split(",")))
        except (ValueError, TypeError):
            raise RenderError(
                f"'{text}' is not a region; give left,top,right,bottom in pixels from the upper "
                "left corner, such as 100,80,140,120."
            ) from None

    def check(self, size: int) -> None:
        """Raise :class:`RenderError` unless the region lies in an image of this size."""
        if not (0 <= self.left < self.right <= size and 0 <= self.top < self.bottom <= size):
            raise RenderError(
                f"The region from ({self.left}, {self.top}) to ({self.right}, {self.bottom}) is "
                f"empty or outside the image of {size} x {size} pixels."
            )


def region_sensitivity(
    renderer: RaycastRenderer, view: View, tf: TransferFunction, size: int, region: Region
) -> NDArray[np.float32]:
    """Sensitivity of one region: where in the TF an edit changes it.

    Parameters
    ----------
    renderer : RaycastRenderer
        Unlit.
    view : View
    tf : TransferFunction
    size : int
        Width and height of the image in pixels.
    region : Region

    Returns
    -------
    ndarray of float32, shape (256,)
        Per unit of opacity, at scalar values from one end of the range to the
        other; 0 for a black region, whose norm has no derivative. Where the
        sample distance is below one voxel, opacities above 1 - 1/510 count as
        that: the derivative grows beyond all bounds towards 1.

    Raises
    ------
    RenderError
        For a region outside the image, or a lit scene.
    """
    region.check(size)
    tops = range(region.top, region.bottom, BAND)
    windows = [(top, min(top + BAND, region.bottom), region.left, region.right) for top in tops]
    gradients, energies = renderer.differentiate(
        view, tf.opacity, tf.color, size, np.array(windows, dtype=np.int64)
    )
    return _sensitivity(gradients.sum(axis=0, keepdims=True), energies.sum(keepdims=True))[0]


def sensitivity_field(
    renderer: RaycastRenderer, view: View, tf: TransferFunction, size: int, block: int
) -> NDArray[np.float32]:
    """Sensitivity of each block of the image: where an edit of a scalar value shows.

    Parameters
    ----------
    renderer : RaycastRenderer
        Unlit.
    view : View
    tf : TransferFunction
    size : int
        Width and height of the image in pixels.
    block : int
        Width and height of a block in pixels, from 1 to `size`; blocks at the
        right and lower edge may be smaller.

    Returns
    -------
    ndarray of float32, shape (n, n, 256)
        Rows and columns of blocks from the upper left; see
        :func:`region_sensitivity`.

    Raises
    ------
    RenderError
        For a block size outside 1 to `size`, or a lit scene.
    """
    if not 1 <= block <= size:
        raise RenderError(f"Blocks of {block} pixels do not fit into {size}; give 1 to {size}.")
    edges = [(start, min(start + block, size)) for start in range(0, size, block)]
    windows = [(*rows, *columns) for rows in edges for columns in edges]
    gradients, energies = renderer.differentiate(
        view, tf.opacity, tf.color, size, np.array(windows, dtype=np.int64)
    )
    return _sensitivity(gradients, energies).reshape(len(edges), len(edges), -1)


def _sensitivity(
    gradients: NDArray[np.float64], energies: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Derivative of the norm from that of half its square; 0 where the norm is 0."""
    norms = np.sqrt(energies)[:, None]
    return np.divide(gradients, norms, out=np.zeros_like(gradients), where=norms > 0).astype(
        np.float32
    )
