"""Exact sensitivity of rendered images to the opacity TF, a reference for generators.

Sensitivity is the derivative of the l2 norm of an image region's colours by
the 256 values of the opacity TF (paper, Eq. 11, with the renderer in place of
the network).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion, block_edges, windows_of
from model.scene.tf_perturbation import norms_at_all_bins, spaced_edits
from model.scene.transfer_function import TF_SAMPLES

MAX_NUMBERS = 1 << 28
"""Largest sensitivity field: 1024 x 1024 blocks, which need 2 GiB during summation."""


def region_sensitivity(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int | Raster, region: ImageRegion
) -> NDArray[np.float32]:
    """Sensitivity of one region to edits at each scalar value of the TF.

    Parameters
    ----------
    renderer : RaycastRenderer
        Under a light that it differentiates.
    size : int or Raster
        Width and height of the image in pixels, or the pixels of a wider one.

    Returns
    -------
    ndarray of float32, shape (256,)
        Per unit of opacity, at scalar values evenly spaced over the range; 0 for a
        black region, whose norm has no derivative. With sample distances below one
        voxel, opacities are clamped to 1 - 1/510, as the derivative diverges at 1.

    Raises
    ------
    RenderError
        For a region outside the image, or a light without exact derivative.
    """
    windows = windows_of(region.mask(Raster.of(size).shape))
    gradient, energy = renderer.differentiate_together(inputs, size, windows)
    return _sensitivity(gradient[None], np.array([energy]))[0]


def change_norms(
    renderer: RaycastRenderer,
    inputs: SceneInputs,
    size: int | Raster,
    region: ImageRegion,
    width: float,
) -> NDArray[np.float32]:
    """Norm of a region's change by smooth edits around each scalar value.

    Unlike the change of the region's norm, it is above 0 where an edit shows on a black
    region, and where it brightens some pixels and darkens others.

    Parameters
    ----------
    renderer, inputs, size, region
        See :func:`region_sensitivity`.
    width : float
        Standard deviation of the edits in bins; 0 for single bins. Norms between edits 2/3
        of it apart are interpolated.

    Returns
    -------
    ndarray of float32, shape (256,)
        l2 norm of dI over the region's pixels and colours, per unit of opacity.

    Raises
    ------
    RenderError
        For a region outside the image, or a light without exact derivative.
    """
    bins, edits = spaced_edits(width)
    windows = windows_of(region.mask(Raster.of(size).shape))
    return norms_at_all_bins(bins, renderer.squared_changes(inputs, size, windows, edits))


def visibility(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int | Raster, region: ImageRegion
) -> NDArray[np.float32]:
    """Share of each scalar value in a region's opacity (Correa and Ma 2011).

    Returns
    -------
    ndarray of float32, shape (256,)
        Mean over the region's pixels of the sum of T alpha, at scalar values evenly spaced
        over the range; they add up to the region's mean opacity.

    Raises
    ------
    RenderError
        For a region outside the image.
    """
    mask = region.mask(Raster.of(size).shape)
    visible = renderer.visibility(inputs, size, windows_of(mask))
    return (visible / mask.sum()).astype(np.float32)


def sensitivity_field(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int, block: int
) -> NDArray[np.float32]:
    """Sensitivity of each block of the image to edits at each scalar value of the TF.

    Parameters
    ----------
    renderer : RaycastRenderer
        Under a light that it differentiates.
    size : int
        Width and height of the image in pixels.
    block : int
        Width and height of a block in pixels, from 1 to `size`; blocks at the
        right and lower edge may be smaller.

    Returns
    -------
    ndarray of float32, shape (n, n, 256)
        Rows and columns of blocks from the upper left corner; see
        :func:`region_sensitivity`.

    Raises
    ------
    RenderError
        For a block size outside 1 to `size`, a field that is too large for
        memory, or a light without exact derivative.
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
    """Convert derivatives of half the squared norm to those of the norm; 0 if the norm is 0."""
    norms = np.sqrt(energies)[:, None]
    return np.divide(gradients, norms, out=np.zeros_like(gradients), where=norms > 0).astype(
        np.float32
    )
