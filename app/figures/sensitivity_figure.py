"""Figures of sensitivities to publish: titled, with legends, colour bars and units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.figures.plots import (
    AXIS_WIDTH,
    TFPlot,
    add_caption,
    add_image,
    add_rectangle,
    add_tf_plot,
    label_axis,
    new_layout,
    save_layout,
)
from model.scene.region import Region
from model.scene.transfer_function import TF_SAMPLES
from model.sensitivity.display import (
    UNIT,
    Measure,
    color_bar,
    field_of_value,
    overlay,
    overlay_globally,
    scale_of,
    shown_field,
    shown_responses,
    spread_blocks,
)
from model.sensitivity.result import SensitivityResult

MEASURE_NAMES: dict[Measure, str] = {"change": "size of change", "signed": "change of brightness"}

CUT_FROM = 3.0  # factor from which the highest response may be left out of a plot

FIGURE_SIZE = 980, 540
CURVE_SIZE = 1180, 560
BAND_HEIGHT = 230
BAR_WIDTH = 125


def save_figure(
    path: Path, result: SensitivityResult, caption: str = "", region: Region | None = None
) -> None:
    """Draw a result as a PNG file; the region is outlined in the image of its sensitivity."""
    if result.kind == "region":
        _save_curve(path, result, caption, region)
    else:
        _save_field(path, result, caption)


def _save_curve(path: Path, result: SensitivityResult, caption: str, region: Region | None) -> None:
    shown = shown_responses(result.sensitivity, result.pixels, result.width)
    title = f"Sensitivity of {result.place}: {result.source}"
    inside, highest = (float(np.abs(v).max(initial=0)) for v in (shown[result.in_window], shown))
    # Only where the background's values would leave the others flat is the curve cut.
    is_cut = 0 < inside < highest / CUT_FROM
    if is_cut:
        title += f"; reaches beyond to {shown[np.abs(shown).argmax()]:.3g}"
    layout = new_layout(*CURVE_SIZE)
    layout.addLabel(title, 0, 0, 1, 2, color="k")
    image = add_image(layout, 1, 0, "Image", result.image)
    if region is not None:
        add_rectangle(image, region)
    plot = TFPlot(
        "Opacity TF (blue) and sensitivity (red)",
        result.scalar_range,
        result.opacity,
        result.colors,
        result.axis_label,
        responses=shown,
        response_label=f"{MEASURE_NAMES[result.measure]} / +.01",
        window=result.in_window if is_cut else None,
        scale=result.scale,
    )
    add_tf_plot(layout, 1, 1, plot)
    _share_width(layout, 2, 3)
    caption = ", ".join(filter(None, [caption, _edits(result)]))
    add_caption(layout, 2, 2, caption, CURVE_SIZE[0])
    save_layout(path, layout, f"{title}. {caption}")


def _save_field(path: Path, result: SensitivityResult, caption: str) -> None:
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
        caption = f"{caption}, r = {len(result.sensitivity)} blocks along each side"
    scale = scale_of(field)
    width, height = FIGURE_SIZE
    layout = new_layout(width, height + (0 if result.edit is None else BAND_HEIGHT))
    title = f"Sensitivity to {result.place}: {result.source}"
    layout.addLabel(title, 0, 0, 1, 3, color="k")
    add_image(layout, 1, 0, "Image", image)
    if result.whole_scale is not None:
        shown = overlay_globally(image, field, scale, result.whole_scale)
        add_image(layout, 1, 1, MEASURE_NAMES["change"], shown)
        add_bar(layout, 1, 2, color_bar("all values", 256), (0.0, result.whole_scale), label)
        caption = f"{caption}, colours by the fields of all values, opaque from {scale:.2g}"
    else:
        add_image(layout, 1, 1, MEASURE_NAMES[measure], overlay(image, field, scale, measure))
        low = -scale if measure == "signed" else 0.0
        add_bar(layout, 1, 2, color_bar(measure, 256), (low, scale), label)
    if result.edit is not None:
        plot = TFPlot(
            "Opacity TF (blue) and the band of edits (red)",
            result.scalar_range,
            result.opacity,
            result.colors,
            result.axis_label,
            band=result.edit / result.edit.max(),
            scale=result.scale,
        )
        add_tf_plot(layout, 2, 0, plot, columns=3).setMaximumHeight(BAND_HEIGHT)
    for column in range(2):
        layout.ci.layout.setColumnFixedWidth(column, (width - BAR_WIDTH) // 2 - 25)
    caption = ", ".join(filter(None, [caption, _edits(result)]))
    add_caption(layout, 3, 3, caption, width)
    save_layout(path, layout, f"{title}. {caption}")


def _share_width(layout: Any, *shares: int) -> None:
    for column, share in enumerate(shares):
        layout.ci.layout.setColumnStretchFactor(column, share)
        layout.ci.layout.setColumnPreferredWidth(column, 100 * share)


def _edits(result: SensitivityResult) -> str:
    if not result.width:
        return "edits of single samples of the TF"
    lo, hi = result.scalar_range
    units = f" {result.units}" if result.units else ""
    units = units if result.scale == "linear" else " decades"
    width = result.width / (TF_SAMPLES - 1) * (hi - lo)
    return f"edits of standard deviation {width:.3g}{units}"


def add_bar(
    layout: Any,
    row: int,
    column: int,
    colors: NDArray[np.floating],
    ends: tuple[float, float],
    label: str,
) -> None:
    """Add a colour bar of colours (n, 3) from the lower to the higher end of a scale."""
    import pyqtgraph as pg

    low, high = ends
    plot = layout.addPlot(row=row, col=column)
    levels = np.rint(255 * colors).astype(np.uint8)[:, None]
    item = pg.ImageItem(levels, axisOrder="row-major", levels=(0, 255))
    item.setRect(0, low, 1, high - low)
    plot.addItem(item)
    plot.setXRange(0, 1, padding=0)
    plot.setYRange(low, high, padding=0)
    plot.hideAxis("bottom")
    plot.hideAxis("left")
    plot.showAxis("right")
    label_axis(plot, "right", label)
    plot.getAxis("right").setWidth(AXIS_WIDTH)
    plot.setFixedWidth(BAR_WIDTH)
