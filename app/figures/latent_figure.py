"""Figures of the latent map: all samples, what is asked about, and what it shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.figures.plots import (
    CAPTION_HEIGHT,
    COLORS,
    INK,
    add_caption,
    add_image,
    label_axis,
    new_layout,
    save_layout,
)
from model.scene.transfer_function import OpacityTF

MAP_COLOR = 150, 155, 165, 130
WIDTH, HEIGHT = 620, 620


@dataclass(frozen=True, eq=False)
class LatentFigure:
    """Content of a figure of the map.

    Attributes
    ----------
    title : str
        Volume, and who draws the pictures.
    places : ndarray, shape (n, 2)
    image : ndarray, shape (H, W, 3), or None
        Picture beside the map.
    caption : str
        Title of the picture.
    brush : tuple of float, or None
        Rectangle on the map: left, lower, right and upper edge.
    place : tuple of float, or None
        Place on the map.
    opacity_tf : OpacityTF or None
        Plotted below.
    value_label : str
        Label of the TF's axis.
    explanation : str
        What the parts of the figure are, for below them.
    """

    title: str
    places: NDArray[np.floating]
    image: NDArray[np.floating] | None = None
    caption: str = ""
    brush: tuple[float, float, float, float] | None = None
    place: tuple[float, float] | None = None
    opacity_tf: OpacityTF | None = None
    value_label: str = "scalar value"
    explanation: str = ""


def save_latent_figure(path: Path, figure: LatentFigure) -> None:
    """Draw the map with axes, the picture beside it, and the TF below, as a PNG file.

    Raises
    ------
    RenderError
        When the file cannot be written.
    """
    import pyqtgraph as pg

    columns = 1 if figure.image is None else 2
    height = HEIGHT + (CAPTION_HEIGHT if figure.opacity_tf is None else CAPTION_HEIGHT + 240)
    layout = new_layout(columns * WIDTH, height)
    layout.addLabel(figure.title, 0, 0, 1, columns, color=INK)
    plot = layout.addPlot(row=1, col=0)
    plot.setTitle(f"Map of {len(figure.places):,} opacity TFs", color=INK)
    label_axis(plot, "bottom", "first axis of the map")
    label_axis(plot, "left", "second axis of the map")
    plot.setAspectLocked()
    x, y = figure.places.astype(np.float64).T
    plot.addItem(pg.ScatterPlotItem(x, y, size=3, pen=None, brush=pg.mkBrush(*MAP_COLOR)))
    pen = pg.mkPen(COLORS[1], width=2)
    if figure.brush is not None:
        left, lower, right, upper = figure.brush
        for share in np.linspace(0, 1, 5):
            line = left + share * (right - left), lower + share * (upper - lower)
            plot.plot([line[0]] * 2, [lower, upper], pen=pen)
            plot.plot([left, right], [line[1]] * 2, pen=pen)
    if figure.place is not None:
        plot.addItem(pg.ScatterPlotItem(*([v] for v in figure.place), size=14, symbol="+", pen=pen))
    if figure.image is not None:
        add_image(layout, 1, 1, figure.caption, figure.image)
    if figure.opacity_tf is not None:
        tf = layout.addPlot(row=2, col=0, colspan=columns)
        tf.setTitle("Opacity TF", color=INK)
        values = np.linspace(*figure.opacity_tf.scalar_range, 256)
        tf.plot(values, figure.opacity_tf.sample(), pen=pg.mkPen(COLORS[0], width=2))
        label_axis(tf, "bottom", figure.value_label)
        label_axis(tf, "left", "opacity")
        tf.setMaximumHeight(220)
    add_caption(layout, 3, columns, figure.explanation, columns * WIDTH)
    save_layout(path, layout, f"{figure.title}. {figure.explanation}")
