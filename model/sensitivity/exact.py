"""The renderer's own sensitivity to the opacity TF: what a network's can be held against.

Sensitivity is the derivative of the l2 norm of an image region's colours by
the 256 values of the opacity TF (paper, Eq. 9, with the renderer in the place
of the network).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Region, block_edges
from model.scene.transfer_function import TF_SAMPLES

MAX_NUMBERS = 1 << 28
"""Largest sensitivity field: 1024 x 1024 blocks, which take 2 GB while they are summed up."""

BAND = 8
"""Rows of a region that one thread differentiates."""


def region_sensitivity(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int, region: Region
) -> NDArray[np.float32]:
    """Sensitivity of one region: where in the TF an edit changes it.

    Parameters
    ----------
    renderer : RaycastRenderer
        Unlit.
    inputs : SceneInputs
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
    gradients, energies = renderer.differentiate(inputs, size, np.array(windows, dtype=np.int64))
    return _sensitivity(gradients.sum(axis=0, keepdims=True), energies.sum(keepdims=True))[0]


def sensitivity_field(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int, block: int
) -> NDArray[np.float32]:
    """Sensitivity of each block of the image: where an edit of a scalar value shows.

    Parameters
    ----------
    renderer : RaycastRenderer
        Unlit.
    inputs : SceneInputs
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
        For a block size outside 1 to `size`, a field that is too large for
        memory, or a lit scene.
    """
    edges = block_edges(size, block)
    numbers = TF_SAMPLES * (len(edges) - 1) ** 2
    if numbers > MAX_NUMBERS:
        raise RenderError(
            f"The field of {size} x {size} pixels in blocks of {block} has {numbers:.1e} numbers; "
            "choose larger blocks or a smaller image."
        )
    windows = [(*rows, *columns) for rows in pairwise(edges) for columns in pairwise(edges)]
    gradients, energies = renderer.differentiate(inputs, size, np.array(windows, dtype=np.int64))
    return _sensitivity(gradients, energies).reshape(len(edges) - 1, len(edges) - 1, -1)


def _sensitivity(
    gradients: NDArray[np.float64], energies: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Derivative of the norm from that of half its square; 0 where the norm is 0."""
    norms = np.sqrt(energies)[:, None]
    return np.divide(gradients, norms, out=np.zeros_like(gradients), where=norms > 0).astype(
        np.float32
    )
