"""Figures of TF sensitivity as the paper's: regions and values that drive edits (Figs. 8 and 9)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.figures.pages import PICTURE, PLOT, Page
from app.figures.tf_plot import TFPlot
from model.paper.edits import PAPER_R, RegionStep, ValueStep


def save_region_edits(
    path: Path, name: str, units: str, window: NDArray[np.bool_], steps: list[RegionStep]
) -> None:
    """Draw the region sensitivity plots and what the two edits did, as a PNG file."""
    page = Page(
        f"Region sensitivity plots: {name}",
        [PICTURE, PICTURE, PLOT],
        [PICTURE] * len(steps),
    )
    said = []
    for row, step in enumerate(steps):
        last = step.region is None
        title = "after the second edit" if last else ("first region", "second region")[row]
        page.picture(row, 0, f"model, {title}", step.drawn, step.region)
        page.picture(row, 1, "ground truth", step.truth, step.region)
        plot = TFPlot.of(
            "opacity TF" if last else "opacity TF and sensitivity",
            step.inputs,
            units,
            responses=step.responses,
            window=window,
            mode=step.mode,
        )
        page.tf(row, 2, plot)
        if step.changes is not None and step.mode is not None:
            ours, true = step.changes
            said.append(
                f"{step.mode.mean:.4g}{f' {units}' if units else ''} ({ours:.3f}, {true:.3f})"
            )
    page.save(
        path,
        "Blue: opacity TF; red: how the white region's colours change with an edit (Eq. 11, RMS "
        "over its pixels); dashed: the mode added next. Modes were added at "
        f"{' and '.join(said)}; in brackets the region's RMS change by the model and in truth.",
    )


def save_value_edits(
    path: Path, name: str, units: str, window: NDArray[np.bool_], steps: list[ValueStep]
) -> None:
    """Draw the fields of two values and what the two edits did, as a PNG file."""
    page = Page(
        f"Scalar value sensitivity fields: {name}",
        [PICTURE, PICTURE, PICTURE, PICTURE, PLOT],
        [PICTURE] * len(steps),
    )
    ends = []
    for row, step in enumerate(steps):
        field = step.field
        page.picture(row, 0, ("model", "after the first edit", "after both")[row], step.drawn)
        page.picture(row, 1, "ground truth", step.truth)
        if field is None:
            page.tf(row, 4, TFPlot.of("opacity TF", step.inputs, units))
            continue
        page.picture(row, 2, f"field, r = {PAPER_R}", field.blocks)
        page.picture(row, 3, "field, each pixel", field.pixels)
        plot = TFPlot.of(
            f"field of {field.value:.4g}{f' {units}' if units else ''}",
            step.inputs,
            units,
            responses=field.responses,
            window=window,
            band=field.band,
            mode=step.mode,
        )
        page.tf(row, 4, plot)
        ends.append(f"{field.scale:.2g} of {field.whole:.2g}")
    page.save(
        path,
        "Blue: opacity TF; red: sensitivity of the whole image; red area: the Gaussian by which "
        "neighbouring values' fields count; dashed: the mode added next. Colours go by the fields "
        f"of all values, opacity by the field shown: it is opaque from {' and '.join(ends)}, the "
        "end of the colours (change of pixel value per +.01 opacity).",
    )
