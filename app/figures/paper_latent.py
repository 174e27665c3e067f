"""Figures of the latent space as the paper's: two scales, and a walk (Figs. 10 and 11)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.figures.map_plot import Disc, add_map
from app.figures.mosaic import mosaic
from app.figures.pages import PICTURE, PLOT, Page
from app.figures.tf_plot import TFPlot
from model.latent.latent_map import LatentMap
from model.paper.exploration import Exploration, Place
from model.scene.inputs import SceneInputs

GRID = 520
"""Width of a grid of pictures, which is as high as a picture and a plot."""

MAP = 440


def save_explorations(path: Path, name: str, units: str, found: list[Exploration]) -> None:
    """Draw explorations below one another: grid, map, hovered picture and its decoded TF."""
    page = Page(
        f"Exploring the opacity TF latent space: {name}",
        [GRID, MAP, PLOT],
        [GRID // 2] * (2 * len(found)),
    )
    for number, one in enumerate(found):
        add_exploration(page, 2 * number, one, units, chr(ord("a") + number))
    values = ", ".join(f"{v:.3g}" for v in found[0].map.samples.singular_values)
    page.save(
        path,
        "Grid: pictures of the mean codes of the rectangle's 4 x 4 cells; blue: the weights of the "
        "codes that the picture on the right is interpolated from; below it the TF that this code "
        f"decodes to. {len(found[0].map.codes):,} samples; singular values {values}.",
    )


def add_exploration(page: Page, row: int, one: Exploration, units: str, letter: str) -> None:
    """Add grid, map, picture and TF of an exploration in two rows of a page."""
    page.picture(row, 0, f"({letter}) grid of the rectangle", mosaic(one.cells), rows=2)
    hovered = one.hovered
    disc = (*hovered.place, hovered.radius)
    add_map(page.layout, row + 1, 1, "t-SNE of the codes", one.map.places, one.brush, [disc], 2)
    page.picture(row, 2, "picture of the code", hovered.image)
    page.tf(row + 1, 2, decoded_plot("decoded TF", one.inputs, hovered, units))


def save_walk(
    path: Path, name: str, units: str, inputs: SceneInputs, map_: LatentMap, places: list[Place]
) -> None:
    """Draw pictures over decoded TFs over the map with their places, as a PNG file."""
    widths = [max(PICTURE, 1200 // len(places))] * len(places)
    page = Page(f"Latent space interpolation: {name}", widths, [widths[0], 230, MAP])
    discs: list[Disc] = []
    for column, place in enumerate(places):
        page.picture(0, column, f"({column + 1})", place.image)
        page.tf(1, column, decoded_plot(f"decoded TF ({column + 1})", inputs, place, units))
        discs.append((*place.place, place.radius))
    middle, width = max(0, (len(places) - 2) // 2), min(2, len(places))
    title = "places on the map"
    add_map(page.layout, 3, middle, title, map_.places, None, discs, columns=width)
    page.save(
        path,
        "Top: pictures of interpolated latent codes; middle: the opacity TFs that they decode to; "
        "bottom: where they are, as the Gaussian weights of the interpolation.",
    )


def decoded_plot(title: str, inputs: SceneInputs, place: Place, units: str) -> TFPlot:
    """Return the plot of a place's decoded TF, with the colours of its picture."""
    scalar_range = inputs.opacity_tf.scalar_range
    return TFPlot(
        title,
        scalar_range,
        np.asarray(place.opacities),
        inputs.color_tf.sample(scalar_range),
        f"scalar value{f' ({units})' if units else ''}",
    )
