"""Figures of sensitivities to publish: titled, with legends, colour bars and units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from app.figures.plots import Curve, Plot, add_image, new_layout, save_layout, save_plots
from model.sensitivity.display import (
    UNIT,
    color_bar,
    field_of_value,
    overlay,
    scale_of,
    shown_field,
    shown_responses,
    spread_blocks,
)
from model.sensitivity.measure import Measure
from model.sensitivity.result import SensitivityResult

MEASURE_NAMES: dict[Measure, str] = {
    "change": "change (size)",
    "signed": "change (brighter or darker)",
}

FIGURE_SIZE = 980, 500
BAR_WIDTH = 110


def save_figure(path: Path, result: SensitivityResult) -> None:
    """Draw a result as a PNG file.

    Raises
    ------
    RenderError
        When the file cannot be written.
    """
    if result.kind == "region":
        _save_curve(path, result)
    else:
        _save_field(path, result)


def _save_curve(path: Path, result: SensitivityResult) -> None:
    values = result.scalar_values
    shown = shown_responses(result.sensitivity, result.pixels, result.width)
    sensitivity = Curve(f"{result.source}", values, shown)
    opacity = Curve("opacity", values, result.opacity)
    name = MEASURE_NAMES[result.measure]
    limit = 1.2 * float(np.abs(shown[result.in_window]).max(initial=0.0)) or None
    title = f"Sensitivity of {result.place}"
    if limit is not None and np.abs(shown).max() > limit:
        title += f"; reaches {shown[np.abs(shown).argmax()]:.3g}"
    save_plots(
        path,
        [
            Plot(title, result.axis_label, f"{name} per +.01 opacity", (sensitivity,),
                 y_limit=limit),
            Plot("Opacity TF", result.axis_label, "opacity", (opacity,)),
        ],
        height=300,
    )  # fmt: skip


def _save_field(path: Path, result: SensitivityResult) -> None:
    image = np.clip(result.image, 0, 1)
    size = len(image)
    measure = result.measure
    if result.edit is not None:
        field = shown_field(result.sensitivity, result.edit, measure)
        label = UNIT
    else:
        block = -(-size // len(result.sensitivity))
        strength = field_of_value(result.sensitivity, None, result.scalar_range)
        field = np.asarray(spread_blocks(strength, size, block), dtype=np.float64)
        label, measure = "mean over values, each relative to its largest", "change"
    scale = scale_of(field)
    layout = new_layout(*FIGURE_SIZE)
    layout.addLabel(f"Sensitivity to {result.place}: {result.source}", 0, 0, 1, 3, color="k")
    add_image(layout, 1, 0, "Image", image)
    add_image(layout, 1, 1, MEASURE_NAMES[measure], overlay(image, field, scale, measure))
    _add_bar(layout, measure, scale, label)
    save_layout(path, layout)


def _add_bar(layout: Any, measure: Measure, scale: float, label: str) -> None:
    import pyqtgraph as pg

    plot = layout.addPlot(row=1, col=2)
    colors = np.rint(255 * color_bar(measure, 256)).astype(np.uint8)[:, None]
    item = pg.ImageItem(colors, axisOrder="row-major", levels=(0, 255))
    low = -scale if measure == "signed" else 0.0
    item.setRect(0, low, 1, scale - low)
    plot.addItem(item)
    plot.setXRange(0, 1, padding=0)
    plot.setYRange(low, scale, padding=0)
    plot.hideAxis("bottom")
    plot.hideAxis("left")
    plot.showAxis("right")
    axis = plot.getAxis("right")
    axis.enableAutoSIPrefix(False)
    axis.setLabel(label)
    plot.setFixedWidth(BAR_WIDTH)
