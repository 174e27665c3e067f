"""The sensitivity that the window shows, as a result to be saved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.state.sensitivity_answers import SOURCE_NAMES, Answer
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.rendering.raster import middle_square
from model.scene.tf_perturbation import edit_over
from model.scene.value_scale import values_at
from model.sensitivity.result import SensitivityResult


def shown_result(
    state: ViewerState,
    sensitivity: SensitivityState,
    dispatcher: SensitivityDispatcher,
    image: NDArray[np.float32] | None,
    units: str,
) -> SensitivityResult | None:
    """Return what is shown: the field of the band if there is one, else the region's responses.

    Parameters
    ----------
    image : ndarray of float32, shape (H, W, 3), or None
        The image that is differentiated.
    units : str
        Unit of the scalars.

    Returns
    -------
    SensitivityResult or None
        None as long as there is no answer about the present image.
    """
    band = sensitivity.band
    if band is not None and not band.effect:
        # Where values are visible is no sensitivity.
        band = None
    answer: Answer | None = dispatcher.answers.region if band is None else dispatcher.answers.field  # type: ignore[type-arg]
    if answer is None or image is None or not answer.is_of(state.inputs):
        return None
    common = {
        "scalar_range": state.scalar_range,
        "scalar_window": dispatcher.window,
        "units": units,
        "scale": state.scale,
        "opacity": state.transfer_function.opacity.sample(),
        "colors": state.transfer_function.color.sample(),
        "image": image,
        "sensitivity": answer.value,
        "width": answer.request.width,
        "source": SOURCE_NAMES[answer.source],
    }
    if band is not None:
        if answer.request.values != band.values:
            return None
        common["image"] = at_size_of(answer.value, image)
        unit = f" {units}" if units else ""
        low, high = values_at(band.values, state.scale)
        values = f"{low:.5g}" if low == high else f"{low:.5g} to {high:.5g}"
        return SensitivityResult(
            kind="value",
            measure=sensitivity.choices.measure,
            place=f"edits around {values}{unit}",
            pixels=answer.value.shape[0] * answer.value.shape[1],
            edit=edit_over(band.values, state.scalar_range, answer.request.width),
            **common,
        )
    if not dispatcher.answers.is_fresh(answer):
        return None
    shape = answer.request.quality.pixels.shape
    return SensitivityResult(
        kind="region",
        measure=answer.request.measure,
        place=sensitivity.region_name,
        pixels=int(answer.request.region.mask(shape).sum()),
        **common,
    )


def at_size_of(
    field: NDArray[np.float32], image: NDArray[np.float32], sampled: bool = False
) -> NDArray[np.float32]:
    """Return an image with as many pixels as a field of it, which may be of its square only.

    Parameters
    ----------
    field, image : ndarray of float32, shapes (H, W, 3)
    sampled : bool
        Whether pixels are what the image shows in their middle, as if it were rendered with as
        few, instead of means over their areas.
    """
    if field.shape == image.shape:
        return image
    # Imported here: the window starts without it.
    from skimage.transform import resize

    rows, columns, _ = field.shape
    shown = middle_square(image) if rows == columns else image
    order = 3 if sampled else 1
    resized = resize(shown, field.shape, order=order, anti_aliasing=not sampled)
    return np.asarray(resized, dtype=np.float32)
