"""Figures of the latent map: all samples, what is asked about, and what it shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.figures.pages import PLOT, Brush, Disc, Page, add_map
from app.figures.tf_plot import TFPlot

MAP, GRID = 620, 620
"""Widths of the map and of the grid to its left, in pixels; both are as high."""


@dataclass(frozen=True, eq=False)
class LatentFigure:
    """Content of a figure of the map.

    Attributes
    ----------
    grid : ndarray, shape (H, W, 3), or None
        Pictures of a rectangle's cells, to the left of the map.
    brush : tuple of float, or None
        That rectangle: left, lower, right and upper edge.
    picture : ndarray, shape (H, W, 3), or None
        Picture of a place, to the right of the map.
    place : tuple of float, or None
        That place, and the radius of the disc that its code is interpolated over; a radius of 0
        marks a place that is approximate.
    tf : TFPlot or None
        The place's decoded TF, below its picture.
    explanation : str
        What the parts of the figure are, for below them.
    """

    title: str
    places: NDArray[np.floating]
    grid: NDArray[np.floating] | None = None
    brush: Brush | None = None
    picture: NDArray[np.floating] | None = None
    place: Disc | None = None
    tf: TFPlot | None = None
    explanation: str = ""


def save_latent_figure(path: Path, figure: LatentFigure) -> None:
    """Draw grid, map, and a place's picture over its decoded TF, as a PNG file."""
    widths = [MAP]
    if figure.grid is not None:
        widths.insert(0, GRID)
    if figure.picture is not None:
        widths.append(PLOT)
    page = Page(figure.title, widths, [MAP // 2] * 2)
    column = 0
    if figure.grid is not None:
        page.picture(0, 0, "Means of the rectangle's 4 x 4 cells", figure.grid, rows=2)
        column = 1
    title = f"Map of {len(figure.places):,} opacity TFs"
    discs = [] if figure.place is None else [figure.place]
    add_map(page.layout, 1, column, title, figure.places, figure.brush, discs, rows=2)
    if figure.picture is not None and figure.place is not None:
        x, y, _ = figure.place
        page.picture(0, column + 1, f"At {x:.3f},{y:.3f}", figure.picture)
    if figure.tf is not None:
        page.tf(1, column + 1, figure.tf)
    page.save(path, figure.explanation)
