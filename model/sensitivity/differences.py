"""Sensitivity of any renderer's images, by central differences.

For images whose derivative the ray caster does not compute: in soft light, where an edit
also moves shadows, and VTK's. An edit costs two images. Differences of the TF are
small, but not so small that 8-bit images hide them; where they would take away more
opacity than there is, or add more than there can be, they are one-sided.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster
from model.rendering.renderer import Renderer
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion
from model.scene.tf_perturbation import response_to_edits, with_opacity
from model.scene.transfer_function import TF_SAMPLES
from model.sensitivity.measure import Measure

LARGEST_CHANGE = 0.02
"""Largest difference of opacity (per voxel length) to either side."""


def go_on() -> None:
    """Let a computation go on."""


def value_sensitivity(
    renderer: Renderer,
    inputs: SceneInputs,
    size: int | Raster,
    edit: NDArray[np.float32],
    before_each: Callable[[], None] = go_on,
) -> NDArray[np.float32]:
    """Change of each pixel by an edit of the opacity TF.

    Parameters
    ----------
    renderer : Renderer
        Under any lighting.
    size : int or Raster
        Width and height of the image in pixels, or the pixels of a wider one.
    edit : ndarray of float32, shape (256,)
        Differences of opacity, none of them negative, such as those of
        :func:`model.scene.tf_perturbation.edit_around`.
    before_each : callable
        Called before each of the two images; may raise an exception to give up.

    Returns
    -------
    ndarray of float32, shape (rows, columns, 3)
        Per unit of the edit.
    """
    more, less, difference = _images(renderer, inputs, size, edit, before_each)
    return np.asarray((more - less) / difference, dtype=np.float32)


def region_responses(
    renderer: Renderer,
    inputs: SceneInputs,
    size: int | Raster,
    region: ImageRegion,
    width: float,
    measure: Measure = "signed",
    before_each: Callable[[], None] = go_on,
) -> NDArray[np.float32]:
    """Response of a region to smooth edits around each scalar value.

    Parameters
    ----------
    renderer, inputs, size
        See :func:`value_sensitivity`.
    width : float
        Standard deviation of the edits in bins, at least 1. It is also the distance of the
        values that are computed, by two images each; a spline through them is as smooth as
        the responses are.
    measure : {"signed", "change"}
        Change of the l2 norm of the region's colours (paper, Eq. 11), which is 0 for a black
        region, or the l2 norm of their change.
    before_each : callable
        Called before each image; may raise an exception to give up.

    Returns
    -------
    ndarray of float32, shape (256,)
        Per unit of opacity, at scalar values evenly spaced over the range.

    Raises
    ------
    ValueError
        For a width below 1.
    RenderError
        For a region outside the image.
    """
    if width < 1:
        raise ValueError(f"edits are at least 1 bin wide, not {width:g}")
    mask = region.mask(Raster.of(size).shape)
    image = renderer.render(inputs, size)[mask, :3].astype(float)
    norm = np.linalg.norm(image)
    if norm == 0 and measure == "signed":
        return np.zeros(TF_SAMPLES, dtype=np.float32)
    count = int(np.ceil((TF_SAMPLES - 1) / width)) + 1
    bins = np.linspace(0, TF_SAMPLES - 1, count).round().astype(int)
    responses = []
    for edit in response_to_edits(np.eye(TF_SAMPLES, dtype=np.float32)[bins], width):
        more, less, difference = _images(renderer, inputs, size, edit, before_each)
        change = (more - less)[mask] / difference
        if measure == "change":
            responses.append(np.linalg.norm(change))
        else:
            # Not by the two norms: pixels that are black now would count by their square.
            responses.append((image * change).sum() / norm)
    # Imported here: the window, which asks for exact derivatives first, does without it.
    from scipy.interpolate import CubicSpline

    between = CubicSpline(bins, responses)(np.arange(TF_SAMPLES))
    if measure == "change":
        between = np.maximum(between, 0)
    return np.asarray(between, dtype=np.float32)


def _images(
    renderer: Renderer,
    inputs: SceneInputs,
    size: int | Raster,
    edit: NDArray[np.float32],
    before_each: Callable[[], None],
) -> tuple[NDArray[np.float32], NDArray[np.float32], float]:
    """Images with more and with less opacity, and how far these TFs are apart."""
    scalar_range = inputs.opacity_tf.scalar_range
    opacity = inputs.opacity_tf.sample(scalar_range).astype(float)
    step = LARGEST_CHANGE / float(edit.max())
    has_room = (opacity + step * edit <= 1).all() and (opacity - step * edit >= 0).all()
    difference = 2 * step if has_room else step
    # Each bin by itself: an edit may reach one that is transparent, and one that is opaque.
    least = opacity - step * edit if has_room else np.minimum(opacity, 1 - difference * edit)
    images = []
    for shown in (least + difference * edit, least):
        before_each()
        images.append(renderer.render(with_opacity(inputs, shown), size))
    more, less = (image[..., :3] for image in images)
    return more, less, difference
