"""Sensitivity of the ray caster's images, by their exact derivative."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion, block_edges
from model.scene.tf_perturbation import at_all_bins, response_to_edits, spaced_edits
from model.sensitivity import exact
from model.sensitivity.measure import Measure


def region_responses(
    renderer: RaycastRenderer,
    inputs: SceneInputs,
    size: int | Raster,
    region: ImageRegion,
    width: float,
    measure: Measure = "signed",
) -> NDArray[np.float32]:
    """Response (256,) of a region to smooth edits around each scalar value, per unit of opacity.

    Parameters
    ----------
    size : int or Raster
        Width and height of the image in pixels, or the pixels of a wider one.
    width : float
        Standard deviation of the edits in bins.
    measure : {"signed", "change"}
        Change of the l2 norm of the region's colours (paper, Eq. 11), which is 0 for a black
        region, or the l2 norm of their change.
    """
    if measure == "change":
        return exact.change_norms(renderer, inputs, size, region, width)
    slopes = exact.region_sensitivity(renderer, inputs, size, region)
    return response_to_edits(slopes, width)


def block_fields(
    renderer: RaycastRenderer,
    inputs: SceneInputs,
    size: int,
    block: int,
    width: float,
) -> NDArray[np.float32]:
    """Fields of blocks for edits around all scalar values.

    Parameters
    ----------
    renderer, inputs, size, block
        See :func:`model.sensitivity.exact.sensitivity_field`.
    width : float
        Standard deviation of the edits in bins.

    Returns
    -------
    ndarray of float32, shape (n, n, 256)
    """
    if renderer.differentiates_windows:
        slopes = exact.sensitivity_field(renderer, inputs, size, block)
        return response_to_edits(slopes, width)
    # One image for each edit, instead of light taken back for each block.
    image = renderer.render(inputs, size)[..., :3].astype(np.float64)
    edges = block_edges(size, block)
    norms = np.sqrt(_block_sums((image**2).sum(axis=-1), edges))
    bins, edits = spaced_edits(width)
    found = np.empty((*norms.shape, len(bins)))
    for number, edit in enumerate(edits):
        gain = (image * renderer.change(inputs, size, edit)).sum(axis=-1)
        np.divide(
            _block_sums(gain, edges),
            norms,
            out=found[..., number],
            where=norms > 0,
        )
    found[norms == 0] = 0
    return at_all_bins(bins, found).astype(np.float32)


def _block_sums(values: NDArray[np.float64], edges: list[int]) -> NDArray[np.float64]:
    """Sums (n, n) of an image's values over blocks that begin at these pixels."""
    parts = [slice(*ends) for ends in pairwise(edges)]
    return np.array([[values[rows, columns].sum() for columns in parts] for rows in parts])
