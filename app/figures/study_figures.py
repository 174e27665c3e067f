"""Figures of studies: their models side by side, and errors over what a study varies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from app.figures.pages import PICTURE, Page
from app.figures.plots import AXIS_WIDTH, COLORS, INK, label_axis, new_layout, save_layout
from model.evaluation.study import Study, StudyPictures

CURVE_WIDTH, CURVE_HEIGHT = 380, 340

MEASURES = (("opacity_rmse", "opacity image RMSE"), ("rmse", "image RMSE"), ("emd", "colour EMD"))


def save_side_by_side(
    path: Path, study: Study, result: dict[str, Any], found: StudyPictures
) -> None:
    """Draw the same hold-out samples by each model, a column for each, as a PNG file."""
    rows = len(next(iter(found.columns.values())))
    page = Page(study.title, [PICTURE] * len(found.columns), [PICTURE] * rows)
    for column, (label, images) in enumerate(found.columns.items()):
        for row, image in enumerate(images):
            page.picture(row, column, "" if row else label, image)
    page.save(path, f"{result['volume']}, lighting {result['lighting']}; hold-out samples.")


def save_error_curves(path: Path, study: Study, result: dict[str, Any]) -> None:
    """Draw errors over the number that names each variant, and the paper's, as a PNG file."""
    import pyqtgraph as pg

    layout = new_layout(CURVE_WIDTH * len(MEASURES), CURVE_HEIGHT)
    layout.addLabel(study.title, 0, 0, 1, len(MEASURES), color=INK, bold=True)
    names = [variant.label for variant in study.variants]
    places = np.arange(len(names))
    for column, (measure, title) in enumerate(MEASURES):
        plot = layout.addPlot(row=1, col=column)
        plot.setTitle(title, color=INK)
        label_axis(plot, "bottom", study.varied)
        label_axis(plot, "left", "error")
        plot.getAxis("left").setWidth(AXIS_WIDTH)
        plot.getAxis("bottom").setTicks([list(zip(places.tolist(), names, strict=True))])
        ours = [result["variants"][v.name].get(measure, np.nan) for v in study.variants]
        index = {"rmse": 0, "emd": 1}.get(measure)
        papers = [np.nan if v.paper is None or index is None else v.paper[index]
                  for v in study.variants]  # fmt: skip
        if not np.isnan(papers).all():
            plot.addLegend(offset=(30, -30), labelTextColor="k")
        for name, errors, color in (("here", ours, COLORS[0]), ("paper", papers, COLORS[1])):
            if not np.isnan(errors).all():
                plot.plot(
                    places, np.array(errors, dtype=float), name=name, pen=pg.mkPen(color, width=2),
                    symbol="o", symbolBrush=color, symbolPen=None, symbolSize=7, connect="finite",
                )  # fmt: skip
        known = [e for e in (*ours, *papers) if not np.isnan(e)]
        plot.setYRange(0, 1.1 * max(known, default=1.0))
        plot.setXRange(-0.3, len(names) - 0.7)
    save_layout(path, layout, study.title)
