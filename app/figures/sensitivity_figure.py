"""Figures of sensitivities to publish: titled, with legends, colour bars and units."""

from pathlib import Path
from typing import Any

import numpy as np

from app.figures.plots import Page, TFPlot
from model.scene.region import Region
from model.scene.transfer_function import TF_SAMPLES
from model.sensitivity import display
from model.sensitivity.result import SensitivityResult

MEASURE_NAMES: dict[display.Measure, str] = {
    "change": "size of change",
    "signed": "change of brightness",
}

CUT_FROM = 3.0  # factor from which the highest response may be left out of a plot

CURVE_WIDTHS, CURVE_HEIGHT = [464, 696], 450  # of image and curve, in pixels
FIELD, BAND_HEIGHT = 430, 230  # of image and field, and of the plot below them
FIELD_WIDTHS = [418, 418, 125]  # of image, field and colour bar


def save_figure(
    path: Path, result: SensitivityResult, caption: str = "", region: Region | None = None
) -> None:
    """Draw a result as a PNG file; the region is outlined in the image of its sensitivity."""
    if result.kind == "region":
        _save_curve(path, result, caption, region)
    else:
        _save_field(path, result, caption)


def _save_curve(path: Path, result: SensitivityResult, caption: str, region: Region | None) -> None:
    shown = display.shown_responses(result.sensitivity, result.pixels, result.width)
    title = f"Sensitivity of {result.place}: {result.source}"
    inside, highest = (float(np.abs(v).max(initial=0)) for v in (shown[result.in_window], shown))
    # The curve is cut off only if the background's values would make the others flat.
    is_cut = 0 < inside < highest / CUT_FROM
    if is_cut:
        title += f"; the curve leaves the plot, up to {shown[np.abs(shown).argmax()]:.3g}"
    page = Page(title, CURVE_WIDTHS, [CURVE_HEIGHT])
    page.picture(0, 0, "Image", result.image, region)
    label, window = f"{MEASURE_NAMES[result.measure]} / +.01", result.in_window if is_cut else None
    content = _plot_of(result, "sensitivity", responses=shown, response_label=label, window=window)
    page.tf(0, 1, content)
    page.save(path, ", ".join(filter(None, [caption, _edits(result)])))


def _plot_of(result: SensitivityResult, red: str, **others: Any) -> TFPlot:
    of = result.scalar_range, result.opacity, result.colors, result.axis_label
    return TFPlot(f"Opacity TF (blue) and {red} (red)", *of, scale=result.scale, **others)


def _save_field(path: Path, result: SensitivityResult, caption: str) -> None:
    image = np.clip(result.image, 0, 1)
    size = len(image)
    measure = result.measure
    if result.edit is not None:
        field = display.shown_field(result.sensitivity, result.edit, measure)
        label = display.UNIT
    else:
        block = -(-size // len(result.sensitivity))
        strength = display.field_of_value(result.sensitivity, None, result.scalar_range)
        field = np.asarray(display.spread_blocks(strength, size, block), dtype=np.float64)
        label, measure = "mean over values, each relative to its largest", "change"
        caption = f"{caption}, r = {len(result.sensitivity)} blocks along each side"
    scale = display.scale_of(field)
    heights = [FIELD] if result.edit is None else [FIELD, BAND_HEIGHT]
    page = Page(f"Sensitivity to {result.place}: {result.source}", FIELD_WIDTHS, heights)
    page.picture(0, 0, "Image", image)
    if result.whole_scale is not None:
        shown = display.overlay_globally(image, field, scale, result.whole_scale)
        page.picture(0, 1, MEASURE_NAMES["change"], shown)
        page.bar(0, 2, display.color_bar("all values", 256), (0.0, result.whole_scale), label)
        caption = f"{caption}, colours by the fields of all values, opaque from {scale:.2g}"
    else:
        page.picture(0, 1, MEASURE_NAMES[measure], display.overlay(image, field, scale, measure))
        low = -scale if measure == "signed" else 0.0
        page.bar(0, 2, display.color_bar(measure, 256), (low, scale), label)
    if result.edit is not None:
        band = result.edit / result.edit.max()
        page.tf(1, 0, _plot_of(result, "the band of edits", band=band), columns=3)
    page.save(path, ", ".join(filter(None, [caption, _edits(result)])))


def _edits(result: SensitivityResult) -> str:
    if not result.width:
        return "edits of single samples of the TF"
    lo, hi = result.scalar_range
    units = f" {result.units}" if result.units else ""
    units = units if result.scale == "linear" else " decades"
    width = result.width / (TF_SAMPLES - 1) * (hi - lo)
    return f"edits of standard deviation {width:.3g}{units}"
