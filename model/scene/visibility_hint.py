"""Whether an image shows nothing, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs
from model.scene.transfer_function import TF_SAMPLES, OpacityTF, Range
from model.scene.view import VIEW_ANGLE, View

FAINTEST = 1.5 / 255
"""Opacity of a pixel below which it is not seen: hardly a level of an 8-bit image."""

TRANSPARENT = 1e-5
"""Opacity of a voxel below which even a thousand of them, one behind another, are not seen."""

FEW = 1e-5
"""Share of the voxels that is easily missed in an image."""

FAINT_PART = 0.01
"""Fraction of a TF's largest opacity below which a scalar value hardly counts as shown."""

POINTS_PER_BIN = 9
"""Scalar values of a bin at which the opacity is looked up."""

CLOSE = 0.7
"""Distance of the view below which a part of the volume may lie outside the image."""

SMALLEST = 0.01
"""Least diameter of a visible volume, as a fraction of the image's height."""

Cause = Literal["tf", "crop", "view"]


@dataclass(frozen=True)
class Emptiness:
    """Why an image shows nothing.

    Attributes
    ----------
    text : str
        One sentence for the user.
    cause : {"tf", "crop", "view"}
        What to change: the TF, the crop box, or the view.
    """

    text: str
    cause: Cause


def nothing_visible(rgba: NDArray[np.float32]) -> bool:
    """Return whether no pixel of an image is opaque enough to be seen.

    Parameters
    ----------
    rgba : ndarray of float32, shape (H, W, 4)
        Opacity last, 0..1; NaN counts as transparent.
    """
    opacity = rgba[..., 3]
    return not bool((opacity >= FAINTEST).any())


def why_nothing(
    inputs: SceneInputs,
    volume_range: Range,
    counts: NDArray[np.int64],
    edges: NDArray[np.float64],
    aspect: float = 1.0,
) -> Emptiness:
    """Explain why an image shows nothing.

    Parameters
    ----------
    volume_range : tuple of float
        The smallest and largest voxel.
    counts : ndarray of int64, shape (B,)
        Voxels in each bin of the scalar values.
    edges : ndarray of float64, shape (B + 1,)
        Limits of the bins, in the data's units, ascending.
    """
    if found := _unshown_values(inputs.opacity_tf, volume_range, counts, edges):
        return Emptiness(found, "tf")
    if found := _out_of_view(inputs.view, aspect):
        return Emptiness(found, "view")
    if inputs.crop is not None and not inputs.crop.is_whole:
        return Emptiness("The crop box leaves nothing of what the TF shows in this view.", "crop")
    view = inputs.view
    if view.distance < CLOSE or view.pan_x or view.pan_y:
        return Emptiness("The view shows a part of the volume where the TF shows nothing.", "view")
    return Emptiness("What the TF shows is too transparent to be seen.", "tf")


def _unshown_values(
    opacity_tf: OpacityTF,
    volume_range: Range,
    counts: NDArray[np.int64],
    edges: NDArray[np.float64],
) -> str:
    """Say why a TF shows none of the volume's values; empty if it shows some."""
    # As renderers see it: sampled over its range, and beyond it as at its ends.
    values = np.linspace(*opacity_tf.scalar_range, TF_SAMPLES)
    samples = opacity_tf.sample()
    peak = float(samples.max())
    if peak < TRANSPARENT:
        return "The TF is transparent at every scalar value."
    least = max(TRANSPARENT, FAINT_PART * peak)
    low, high = values[samples >= least][[0, -1]]
    shown = "the scalar value" if low == high else "scalar values from"
    shown += f" {low:.4g}" if low == high else f" {low:.4g} to {high:.4g}"
    first, last = volume_range
    ends = np.interp([first, last], values, samples)
    if (low > last or high < first) and ends.max() < least:
        return (
            f"The TF shows only {shown}, but the volume's lie between {first:.4g} and {last:.4g}."
        )
    within = edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0, 1, POINTS_PER_BIN)
    bins = np.interp(within, values, samples).max(axis=1) >= least
    count, total = int(counts[bins].sum()), int(counts.sum())
    if count == 0:
        return f"The TF shows only {shown}, which no voxel has."
    if count < FEW * total:
        voxels = "voxel" if count == 1 else "voxels"
        return f"The TF shows only {shown}, which {count:,} {voxels} of {total:,} have."
    return ""


def _out_of_view(view: View, aspect: float) -> str:
    """Say how a view misses the volume's bounding sphere; empty if it does not."""
    half_angle = math.radians(VIEW_ANGLE / 2)
    sine = math.sin(half_angle) / view.distance
    if sine >= 1:
        return ""  # The camera is inside the sphere.
    # In halves of the image's height, like the pan.
    radius = math.tan(math.asin(sine)) / math.tan(half_angle)
    if abs(view.pan_x) > aspect + radius or abs(view.pan_y) > 1 + radius:
        return "The view was moved until the volume left the image."
    if radius < SMALLEST:
        return "The view is so far away that the volume is too small to be seen."
    return ""
