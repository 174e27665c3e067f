"""Smooth edits of the opacity TF, which sensitivities refer to.

Users do not edit single bins, and networks that were trained on smooth TFs give noise for them.
Sensitivities are therefore derivatives by Gaussian edits of some width.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs
from model.scene.transfer_function import TF_SAMPLES, Range

EDIT_WIDTH = 6.0
"""Standard deviation of edits, in bins of the TF.

Users drag modes, not single bins. For an earlier generator, the median cosine similarity
to the renderer's sensitivities rose from 0.19 for single bins to 0.61.
"""


def edit_around(value: float, scalar_range: Range, width: float) -> NDArray[np.float32]:
    """Return the edit of :func:`edit_over` (256,) around one scalar value."""
    return edit_over((value, value), scalar_range, width)


def edit_over(values: Range, scalar_range: Range, width: float) -> NDArray[np.float32]:
    """Return a smooth edit (256,) over an interval of values.

    Its opacities sum to 1. The width is the flanks' standard deviation in bins; 0 for the
    interval's bins alone.
    """
    first, last = (_bin(value, scalar_range) for value in values)
    flat = np.zeros(TF_SAMPLES, dtype=np.float32)
    flat[first : last + 1] = 1 / (last - first + 1)
    return response_to_edits(flat, width)


def band_of_edit(values: Range, scalar_range: Range, width: float) -> Range:
    """Return the values at which :func:`edit_over` has at least half of its height."""
    edit = edit_over(values, scalar_range, width)
    inside = np.flatnonzero(edit >= edit.max() / 2)
    first, last = np.linspace(*scalar_range, len(edit))[inside[[0, -1]]].tolist()
    return first, last


def spaced_edits(width: float) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return bins (n,), 2/3 of a width apart, and opacities (n, 256) of edits around them."""
    spacing = max(1, math.ceil(2 * width / 3))
    count = -(-(TF_SAMPLES - 1) // spacing) + 1
    bins = np.linspace(0, TF_SAMPLES - 1, count).round().astype(np.int64)
    return bins, response_to_edits(np.eye(TF_SAMPLES, dtype=np.float32)[bins], width)


def norms_at_all_bins(
    bins: NDArray[np.int64], squares: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Square roots at all 256 bins, by a spline through squares at some bins."""
    return np.sqrt(np.maximum(at_all_bins(bins, squares), 0)).astype(np.float32)


def at_all_bins(bins: NDArray[np.int64], values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Values (..., 256) at all bins, by a spline through values (..., n) at some bins."""
    if len(bins) == TF_SAMPLES:
        return values
    # Imported here, as below, since the window starts without SciPy.
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(bins, values, axis=-1)(np.arange(TF_SAMPLES)))


def response_to_edits(slopes: NDArray[np.float32], width: float) -> NDArray[np.float32]:
    """Convert derivatives (..., 256) by single bins to responses to edits around each value."""
    if width == 0:
        return slopes
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(slopes, width, axis=-1, mode="constant"))


def with_opacity(inputs: SceneInputs, opacity: NDArray[np.floating]) -> SceneInputs:
    """Return inputs with another opacity TF, given by its 256 opacities, which are clipped."""
    scalar_range = inputs.opacity_tf.scalar_range
    values = np.linspace(*scalar_range, TF_SAMPLES).tolist()
    points = tuple(zip(values, np.clip(opacity, 0, 1).tolist(), strict=True))
    return replace(inputs, opacity_tf=replace(inputs.opacity_tf, modes=(), points=points))


def _bin(value: float, scalar_range: Range) -> int:
    lo, hi = scalar_range
    place = round((value - lo) / (hi - lo) * (TF_SAMPLES - 1))
    return min(max(place, 0), TF_SAMPLES - 1)
