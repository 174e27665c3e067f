"""Sensitivity of any renderer's images, by central differences.

For images whose derivative the ray caster does not compute: under global light, where an
edit also moves shadows, and VTK's. An edit costs two images. Differences of the TF are
small, but not so small that 8-bit images hide them; where they would take away more
opacity than there is, they are one-sided.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from model.rendering.renderer import Renderer
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.tf_perturbation import edit_around
from model.scene.transfer_function import TF_SAMPLES, OpacityTF

LARGEST_CHANGE = 0.02
"""Largest difference of opacity (per voxel length) to either side."""


def value_sensitivity(
    renderer: Renderer, inputs: SceneInputs, size: int, value: float, width: float
) -> NDArray[np.float32]:
    """Change of each pixel by an edit of the opacity TF around one scalar value.

    Parameters
    ----------
    renderer : Renderer
        Under any lighting.
    inputs : SceneInputs
    size : int
        Width and height of the image in pixels.
    value : float
        In the data's units.
    width : float
        Standard deviation of the edit in bins; 0 for a single bin.

    Returns
    -------
    ndarray of float32, shape (size, size, 3)
        Per unit of opacity; an edit's opacities add up to 1.
    """
    more, less, difference = _images(renderer, inputs, size, value, width)
    return np.asarray((more - less) / difference, dtype=np.float32)


def region_responses(
    renderer: Renderer, inputs: SceneInputs, size: int, region: Region, width: float
) -> NDArray[np.float32]:
    """Response of a region to smooth edits around each scalar value (paper, Eq. 9).

    Parameters
    ----------
    renderer, inputs, size
        See :func:`value_sensitivity`.
    region : Region
    width : float
        Standard deviation of the edits in bins, at least 1. It is also the distance of the
        values that are computed, by two images each; a spline through them is as smooth as
        the responses are.

    Returns
    -------
    ndarray of float32, shape (256,)
        Change of the l2 norm of the region's colours per unit of opacity, at scalar values
        evenly spaced over the range; 0 for a black region.

    Raises
    ------
    ValueError
        For a width below 1.
    RenderError
        For a region outside the image.
    """
    if width < 1:
        raise ValueError(f"edits are at least 1 bin wide, not {width:g}")
    region.check(size)
    scalar_range = inputs.opacity_tf.scalar_range
    rows, columns = slice(region.top, region.bottom), slice(region.left, region.right)
    image = renderer.render(inputs, size)[rows, columns, :3].astype(float)
    norm = np.linalg.norm(image)
    if norm == 0:
        return np.zeros(TF_SAMPLES, dtype=np.float32)
    count = int(np.ceil((TF_SAMPLES - 1) / width)) + 1
    bins = np.linspace(0, TF_SAMPLES - 1, count).round()
    responses = []
    for value in np.linspace(*scalar_range, TF_SAMPLES)[bins.astype(int)]:
        more, less, difference = _images(renderer, inputs, size, float(value), width)
        # Not by the two norms: pixels that are black now would count by their square.
        responses.append((image * (more - less)[rows, columns]).sum() / norm / difference)
    return np.asarray(CubicSpline(bins, responses)(np.arange(TF_SAMPLES)), dtype=np.float32)


def _images(
    renderer: Renderer, inputs: SceneInputs, size: int, value: float, width: float
) -> tuple[NDArray[np.float32], NDArray[np.float32], float]:
    """Images with more and with less opacity around a value, and how far these TFs are apart."""
    scalar_range = inputs.opacity_tf.scalar_range
    opacity = inputs.opacity_tf.sample(scalar_range).astype(float)
    edit = edit_around(value, scalar_range, width).astype(float)
    step = LARGEST_CHANGE / edit.max()
    above = step if (opacity + step * edit <= 1).all() else 0.0
    below = step if (opacity - step * edit >= 0).all() or above == 0 else 0.0
    more, less = (
        renderer.render(_with_opacity(inputs, opacity + change * edit), size)[..., :3]
        for change in (above, -below)
    )
    return more, less, above + below


def _with_opacity(inputs: SceneInputs, opacity: NDArray[np.float64]) -> SceneInputs:
    scalar_range = inputs.opacity_tf.scalar_range
    values = np.linspace(*scalar_range, TF_SAMPLES).tolist()
    points = tuple(zip(values, np.clip(opacity, 0, 1).tolist(), strict=True))
    return replace(inputs, opacity_tf=OpacityTF(scalar_range, points=points))
