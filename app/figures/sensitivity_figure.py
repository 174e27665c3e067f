"""Figures of sensitivities to publish: titled, with legends, colour bars and units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.figures.plots import (
    AXIS_WIDTH,
    Curve,
    Plot,
    add_caption,
    add_image,
    add_plot,
    label_axis,
    new_layout,
    save_layout,
)
from model.scene.region import Region
from model.scene.transfer_function import TF_SAMPLES
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
from model.sensitivity.global_scale import global_color_bar, overlay_globally
from model.sensitivity.measure import Measure
from model.sensitivity.result import SensitivityResult

MEASURE_NAMES: dict[Measure, str] = {
    "change": "size of change",
    "signed": "change of brightness",
}

CUT_FROM = 3.0
"""Factor from which the highest response may be left out of a plot of those of interest."""

FIGURE_SIZE = 980, 540
CURVE_SIZE = 1180, 640
BAR_WIDTH = 125


def save_figure(
    path: Path, result: SensitivityResult, caption: str = "", region: Region | None = None
) -> None:
    """Draw a result as a PNG file.

    Parameters
    ----------
    path : Path
    result : SensitivityResult
    caption : str
        What the image shows: volume, view, TF, lighting.
    region : Region or None
        Rectangle to outline in the image of a region's sensitivity.

    Raises
    ------
    RenderError
        When the file cannot be written.
    """
    if result.kind == "region":
        _save_curve(path, result, caption, region)
    else:
        _save_field(path, result, caption)


def _save_curve(path: Path, result: SensitivityResult, caption: str, region: Region | None) -> None:
    values = result.scalar_values
    shown = shown_responses(result.sensitivity, result.pixels, result.width)
    sensitivity = Curve(f"{result.source}", values, shown)
    opacity = Curve("opacity", values, result.opacity)
    name = MEASURE_NAMES[result.measure]
    title = f"Sensitivity of {result.place}"
    inside, highest = (float(np.abs(v).max(initial=0)) for v in (shown[result.in_window], shown))
    # Only where the background's values would leave the others flat is the curve cut.
    limit = 1.2 * inside if 0 < inside < highest / CUT_FROM else None
    if limit is not None:
        title += f"; reaches beyond to {shown[np.abs(shown).argmax()]:.3g}"
    plots = (
        Plot(title, result.axis_label, f"{name} / +.01", (sensitivity,), y_limit=limit),
        Plot("Opacity TF", result.axis_label, "opacity", (opacity,)),
    )
    layout = new_layout(*CURVE_SIZE)
    for row, plot in enumerate(plots):
        add_plot(layout, row, 0, plot)
    image = add_image(layout, 0, 1, "Image", result.image, rows=2)
    if region is not None:
        _outline(image, region)
    _share_width(layout, 3, 2)
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
    scale = scale_of(field)
    layout = new_layout(*FIGURE_SIZE)
    title = f"Sensitivity to {result.place}: {result.source}"
    layout.addLabel(title, 0, 0, 1, 3, color="k")
    add_image(layout, 1, 0, "Image", image)
    if result.whole_scale is not None:
        shown = overlay_globally(image, field, scale, result.whole_scale)
        add_image(layout, 1, 1, MEASURE_NAMES["change"], shown)
        add_bar(layout, 1, 2, global_color_bar(256), (0.0, result.whole_scale), label)
        caption = f"{caption}, colours by the fields of all values, opaque from {scale:.2g}"
    else:
        add_image(layout, 1, 1, MEASURE_NAMES[measure], overlay(image, field, scale, measure))
        low = -scale if measure == "signed" else 0.0
        add_bar(layout, 1, 2, color_bar(measure, 256), (low, scale), label)
    _share_width(layout, 1, 1)
    caption = ", ".join(filter(None, [caption, _edits(result)]))
    add_caption(layout, 2, 3, caption, FIGURE_SIZE[0])
    save_layout(path, layout, f"{title}. {caption}")


def _share_width(layout: Any, *shares: int) -> None:
    """Divide the width among the columns."""
    for column, share in enumerate(shares):
        layout.ci.layout.setColumnStretchFactor(column, share)
        layout.ci.layout.setColumnPreferredWidth(column, 100 * share)


def _edits(result: SensitivityResult) -> str:
    """Say how wide the edits are."""
    if not result.width:
        return "edits of single samples of the TF"
    lo, hi = result.scalar_range
    units = f" {result.units}" if result.units else ""
    width = result.width / (TF_SAMPLES - 1) * (hi - lo)
    return f"edits of standard deviation {width:.3g}{units}"


def _outline(plot: Any, region: Region) -> None:
    import pyqtgraph as pg

    x = [region.left, region.right, region.right, region.left, region.left]
    y = [region.top, region.top, region.bottom, region.bottom, region.top]
    plot.plot(x, y, pen=pg.mkPen("w", width=2))


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
