"""Sensitivity of the ray caster's images under any lighting: exact, or else by differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.tf_perturbation import response_to_edits
from model.sensitivity import differences, exact


def value_sensitivity(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int, value: float, width: float
) -> NDArray[np.float32]:
    """Change of each pixel by an edit; see :func:`model.sensitivity.exact.value_sensitivity`."""
    differentiate: Callable[..., NDArray[np.float32]] = differences.value_sensitivity
    if renderer.is_differentiable:
        differentiate = exact.value_sensitivity
    return differentiate(renderer, inputs, size, value, width)


def region_responses(
    renderer: RaycastRenderer, inputs: SceneInputs, size: int, region: Region, width: float
) -> NDArray[np.float32]:
    """Response of a region to smooth edits around each scalar value (paper, Eq. 9).

    Parameters and results are those of :func:`model.sensitivity.differences.region_responses`;
    where the derivative is exact, edits may also be narrower than a bin.
    """
    if renderer.is_differentiable:
        slopes = exact.region_sensitivity(renderer, inputs, size, region)
        return response_to_edits(slopes, width)
    return differences.region_responses(renderer, inputs, size, region, width)
