"""Effect of an edit on an image: rendered, and predicted by its derivative."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion, Mask
from model.scene.tf_perturbation import with_opacity
from model.sensitivity.display import SMALL_EDIT, shown_field


@dataclass(frozen=True, eq=False)
class WhatIf:
    """An edit, rendered."""

    image: NDArray[np.float32]  # with the edit, shape (S, S, 3)
    difference: NDArray[np.float32]  # from the image without it
    rmse: float  # of the difference, over the region
    predicted: float | None = None  # `rmse` to first order; None if unknown
    brighter: float = 0.0  # change of the root mean square of the region's colours


def edited(inputs: SceneInputs, edit: NDArray[np.floating], height: float) -> SceneInputs:
    """Return inputs with an edit (256,) of a given height added to the opacity TF."""
    opacity = inputs.opacity_tf.sample().astype(np.float64)
    shape = edit.astype(np.float64) / np.abs(edit).max()
    return with_opacity(inputs, opacity + height * shape)


def compare(
    before: NDArray[np.float32],
    after: NDArray[np.float32],
    mask: Mask,
    predicted: float | None = None,
) -> WhatIf:
    """Compare two images (S, S, 3 or 4) over a region's pixels (S, S)."""
    one, other = before[..., :3], after[..., :3]
    difference = other - one
    dark, bright, rmse = (
        float(np.sqrt(np.square(each[mask], dtype=np.float64).mean()))
        for each in (one, other, difference)
    )
    return WhatIf(other, difference, rmse, predicted, bright - dark)


def predicted_rmse(
    field: NDArray[np.float32], edit: NDArray[np.floating], height: float, region: ImageRegion
) -> float:
    """Root mean square of a region's changes by an edit, from its field (H, W, 3) per unit."""
    shown = shown_field(field, edit, "change")
    inside = shown[region.mask(shown.shape)]
    return height / SMALL_EDIT * float(np.sqrt(np.square(inside).mean()))
