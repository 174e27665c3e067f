"""The sensitivity that the window shows, as a result to be saved."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.state.sensitivity_answers import Answer
from app.state.sensitivity_asker import SensitivityAsker
from model.rendering.resizing import at_size_of
from model.scene.tf_perturbation import edit_over
from model.scene.value_scale import values_at
from model.sensitivity.result import SensitivityResult


def shown_result(
    asker: SensitivityAsker, image: NDArray[np.float32] | None, units: str
) -> SensitivityResult | None:
    """Return what is shown: the field of the band if there is one, else the region's responses.

    It is None as long as there is no answer about the present image, of which this is the picture.
    """
    state, band = asker.state, asker.asked.band
    if band is not None and not band.effect:
        # Where values are visible is no sensitivity.
        band = None
    answer: Answer[Any] | None = asker.region if band is None else asker.field
    if answer is None or image is None or not answer.is_of(state.inputs):
        return None
    common = {
        "scalar_range": state.scalar_range,
        "scalar_window": asker.window,
        "units": units,
        "scale": state.scale,
        "opacity": state.transfer_function.opacity.sample(),
        "colors": state.transfer_function.color.sample(),
        "image": image,
        "sensitivity": answer.value,
        "width": answer.request.width,
        "source": answer.source,
    }
    if band is None:
        if not asker.is_fresh(answer):
            return None
        shape = answer.request.quality.pixels.shape
        return SensitivityResult(
            kind="region",
            measure=answer.request.measure,
            place=asker.asked.region_name,
            pixels=int(answer.request.region.mask(shape).sum()),
            **common,
        )
    if answer.request.values != band.values:
        return None
    low, high = values_at(band.values, state.scale)
    values = f"{low:.5g}" if low == high else f"{low:.5g} to {high:.5g}"
    common["image"] = at_size_of(answer.value, image)
    return SensitivityResult(
        kind="value",
        measure=asker.asked.choices.measure,
        place=f"edits around {values}{f' {units}' if units else ''}",
        pixels=answer.value.shape[0] * answer.value.shape[1],
        edit=edit_over(band.values, state.scalar_range, answer.request.width),
        **common,
    )
