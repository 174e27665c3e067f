"""Exact sensitivity of rendered images to the opacity TF, a reference for generators.

Sensitivity is the derivative of the l2 norm of an image region's colours by the 256 values of the
opacity TF (paper, Eq. 11, with the renderer in place of the network).
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion, block_edges, block_sums, windows_of
from model.scene.tf_perturbation import (
    at_all_bins,
    norms_at_all_bins,
    response_to_edits,
    spaced_edits,
)
from model.scene.transfer_function import TF_SAMPLES
from model.sensitivity.display import Measure

MAX_NUMBERS = 1 << 28  # blocks of the largest field: 1024 x 1024, 2 GiB during summation


def region_sensitivity(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int | Raster, region: ImageRegion
) -> NDArray[np.float32]:
    """Sensitivity (256,) of one region to edits at each scalar value of the TF.

    It is per unit of opacity; 0 for a black region, whose norm has no derivative. For samples
    closer than a voxel, opacities are clamped to 1 - 1/510, as the derivative diverges at 1. Raises
    :class:`RenderError` for a region outside the image, or a light without exact derivative.
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
    """l2 norm (256,) of a region's change by smooth edits around each value, per unit of opacity.

    Unlike the change of the region's norm, it is above 0 if an edit is visible on a black region,
    or brightens some pixels and darkens others. The width is the standard deviation of the edits in
    bins, 0 for single ones; norms are interpolated between edits 2/3 of it apart.
    """
    bins, edits = spaced_edits(width)
    windows = windows_of(region.mask(Raster.of(size).shape))
    return norms_at_all_bins(bins, renderer.squared_changes(inputs, size, windows, edits))


def visibility(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int | Raster, region: ImageRegion
) -> NDArray[np.float32]:
    """Share (256,) of each scalar value in a region's mean opacity (Correa and Ma 2011)."""
    mask = region.mask(Raster.of(size).shape)
    visible = renderer.visibility(inputs, size, windows_of(mask))
    return (visible / mask.sum()).astype(np.float32)


def sensitivity_field(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int, block: int
) -> NDArray[np.float32]:
    """Sensitivity of each block of the image to edits at each scalar value of the TF."""
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
    found = np.divide(gradients, norms, out=np.zeros_like(gradients), where=norms > 0)
    return found.astype(np.float32)


def region_responses(
    renderer: RaycastRenderer,
    inputs: SceneInputs,
    size: int | Raster,
    region: ImageRegion,
    width: float,
    measure: Measure = "signed",
) -> NDArray[np.float32]:
    """Response (256,) of a region to smooth edits of a width in bins, per unit of opacity."""
    if measure == "change":
        return change_norms(renderer, inputs, size, region, width)
    slopes = region_sensitivity(renderer, inputs, size, region)
    return response_to_edits(slopes, width)


def block_fields(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int, block: int, width: float
) -> NDArray[np.float32]:
    """Fields (n, n, 256) of blocks for edits of a width around all scalar values."""
    if renderer.differentiates_windows:
        slopes = sensitivity_field(renderer, inputs, size, block)
        return response_to_edits(slopes, width)
    # One image for each edit, instead of light propagated back for each block.
    image = renderer.render(inputs, size)[..., :3].astype(np.float64)
    edges = block_edges(size, block)
    norms = np.sqrt(block_sums((image**2).sum(axis=-1), edges))
    bins, edits = spaced_edits(width)
    found = np.empty((*norms.shape, len(bins)))
    for number, edit in enumerate(edits):
        gain = (image * renderer.change(inputs, size, edit)).sum(axis=-1)
        np.divide(block_sums(gain, edges), norms, out=found[..., number], where=norms > 0)
    found[norms == 0] = 0
    return at_all_bins(bins, found).astype(np.float32)
