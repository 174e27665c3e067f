"""Sensitivity of the ray caster's images under any lighting: exact, or else by differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion
from model.scene.tf_perturbation import response_to_edits
from model.sensitivity import differences, exact
from model.sensitivity.measure import Measure


def value_sensitivity(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int | Raster, edit: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Change of each pixel by an edit; see :func:`model.sensitivity.differences.value_sensitivity`.

    Where the derivative is exact, edits may also be negative.
    """
    if renderer.is_differentiable:
        return renderer.change(inputs, size, edit)
    return differences.value_sensitivity(renderer, inputs, size, edit)


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
