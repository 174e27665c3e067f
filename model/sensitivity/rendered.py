"""Sensitivity of the ray caster's images under any lighting: exact, or else by differences."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion
from model.scene.tf_perturbation import response_to_edits
from model.sensitivity import block_fields, differences, exact
from model.sensitivity.measure import Measure


def value_sensitivity(
    renderer: RaycastRenderer,
    inputs: SceneInputs,
    size: int | Raster,
    edit: NDArray[np.float32],
    before_each: Callable[[], None] = differences.go_on,
) -> NDArray[np.float32]:
    """Change of each pixel by an edit; see :func:`model.sensitivity.differences.value_sensitivity`.

    Where the derivative is exact, edits may also be negative.
    """
    if renderer.is_differentiable:
        return renderer.change(inputs, size, edit)
    return differences.value_sensitivity(renderer, inputs, size, edit, before_each)


def region_responses(
    renderer: RaycastRenderer,
    inputs: SceneInputs,
    size: int | Raster,
    region: ImageRegion,
    width: float,
    measure: Measure = "signed",
    before_each: Callable[[], None] = differences.go_on,
) -> NDArray[np.float32]:
    """Response of a region to smooth edits around each scalar value.

    Parameters and results are those of :func:`model.sensitivity.differences.region_responses`;
    where the derivative is exact, edits may also be narrower than a bin.
    """
    if not renderer.is_differentiable:
        return differences.region_responses(
            renderer, inputs, size, region, width, measure, before_each
        )
    if measure == "change":
        return exact.change_norms(renderer, inputs, size, region, width)
    slopes = exact.region_sensitivity(renderer, inputs, size, region)
    return response_to_edits(slopes, width)


def all_fields(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int, blocks: int, width: float
) -> NDArray[np.float32]:
    """Exact fields of blocks for edits around all scalar values.

    Parameters
    ----------
    renderer, inputs, size
        See :func:`model.sensitivity.exact.sensitivity_field`.
    blocks : int
        Number of blocks along either side.
    width : float
        Standard deviation of the edits in bins.

    Returns
    -------
    ndarray of float32, shape (n, n, 256)
    """
    slopes = exact.sensitivity_field(renderer, inputs, size, max(size // blocks, 1))
    return response_to_edits(slopes, width)


def largest_scales(
    renderer: RaycastRenderer,
    inputs: SceneInputs,
    size: int,
    edits: NDArray[np.float32],
    before_each: Callable[[], None] = differences.go_on,
) -> NDArray[np.float32]:
    """Ends of the scale over the exact changes by many edits.

    Parameters
    ----------
    renderer, inputs, size
        See :func:`all_fields`.
    edits : ndarray of float32, shape (N, 256)
    before_each : callable
        Called before the image of each edit; may raise.

    Returns
    -------
    ndarray of float32, shape (2,)
        See :func:`model.sensitivity.block_fields.largest_scales`.
    """

    def changes() -> Iterator[NDArray[np.float32]]:
        for edit in edits:
            before_each()
            yield renderer.change(inputs, size, edit)

    return block_fields.largest_scales(changes(), edits)
