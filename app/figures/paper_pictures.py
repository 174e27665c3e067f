"""Figures of generated images beside true ones, and of the whole approach (Figs. 1, 2 and 12)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.figures.map_plot import add_map
from app.figures.mosaic import mosaic
from app.figures.pages import PICTURE, PLOT, Page
from app.figures.paper_latent import GRID, MAP, decoded_plot
from app.figures.plots import add_image
from app.figures.tf_plot import TFPlot
from model.paper.edits import ValueStep
from model.paper.exploration import Exploration
from model.paper.pictures import Compared, Overview


def save_qualitative(path: Path, found: dict[str, list[Compared]]) -> None:
    """Draw typical samples and artifacts of some volumes, truth above, the model's below."""
    columns = max(len(samples) for samples in found.values())
    page = Page(
        "Ground truth and synthesized images of hold-out samples",
        [PICTURE] * columns,
        [PICTURE] * (2 * len(found)),
    )
    for block, (name, samples) in enumerate(found.items()):
        for column, sample in enumerate(samples):
            title = "ground truth" if sample.why == "typical" else f"artifact: {sample.why}"
            page.picture(2 * block, column, title if column else name, sample.truth)
            error = f"RMSE {sample.errors['rmse']:.3f}, EMD {sample.errors['emd']:.3f}"
            page.picture(2 * block + 1, column, error, sample.drawn)
    page.save(
        path,
        "Of each pair the ground truth is above and the model's image below. Of the hold-out "
        "samples that are not nearly black, 20, 40, 50 and 70 % have a smaller RMSE than those in "
        "the first four columns; artifacts are those with the largest colour EMD and the largest "
        "RMSE of the opacity image.",
    )


def save_teaser(
    path: Path,
    name: str,
    units: str,
    window: NDArray[np.bool_],
    samples: list[Compared],
    step: ValueStep,
    explored: Exploration,
) -> None:
    """Draw (a) synthesized images, (b) TF sensitivity and (c) the latent space, as a PNG file."""
    page = Page(
        f"A generative model for volume rendering: {name}",
        [GRID // 2, GRID // 2, MAP, PLOT],
        [PICTURE, PICTURE, GRID // 2, GRID // 2],
    )
    for row, sample in enumerate(samples[:2]):
        page.picture(row, 0, "(a) ground truth", sample.truth)
        page.picture(row, 1, f"synthesized, RMSE {sample.errors['rmse']:.3f}", sample.drawn)
    field = step.field
    assert field is not None
    page.picture(0, 2, f"(b) where {field.value:.4g} would show", field.blocks, rows=2)
    page.picture(0, 3, "image", step.drawn)
    plot = TFPlot.of(
        "opacity TF and sensitivity", step.inputs, units,
        responses=field.responses, band=field.band, window=window,
    )  # fmt: skip
    page.tf(1, 3, plot)
    _add_explored(page, explored, units)
    page.save(
        path,
        "(a) Images synthesized from view and TFs, beside the ground truth. (b) Opacity TF (blue) "
        "with its sensitivity (red), and the field of the values in the red area. (c) Projection "
        "of the latent space of opacity TFs, pictures of the rectangle's cells, and the picture "
        "and decoded TF of the place in blue.",
    )


def _add_explored(page: Page, explored: Exploration, units: str) -> None:
    """Add part (c) of the teaser: its grid takes two columns."""
    hovered = explored.hovered
    box = page.layout.addLayout(row=3, col=0, rowspan=2, colspan=2)
    add_image(box, 0, 0, "(c) grid of the rectangle", mosaic(explored.cells))
    disc = (*hovered.place, hovered.radius)
    places = explored.map.places
    add_map(page.layout, 3, 2, "t-SNE of the codes", places, explored.brush, [disc], 2)
    page.picture(2, 3, "picture of the code", hovered.image)
    page.tf(3, 3, decoded_plot("decoded TF", explored.inputs, hovered, units))


def save_overview(path: Path, name: str, units: str, found: Overview) -> None:
    """Draw what a model learns from, its networks, and a novel image, as a PNG file."""
    page = Page(
        f"Volume rendering as a generative model: {name}",
        [PICTURE, PLOT, PLOT],
        [PICTURE] * len(found.training),
    )
    for row, sample in enumerate(found.training):
        view = sample.inputs.view
        angles = f"view {view.azimuth:.0f}, {view.elevation:.0f}, {view.roll:.0f}"
        page.picture(row, 0, f"{angles}, distance {view.distance:.2f}", sample.image)
        page.tf(row, 1, TFPlot.of("its TFs", sample.inputs, units))
    lines = [f"{title}: {count / 1e6:.2f} million weights" for title, count in found.networks]
    page.text(0, 2, "(c) networks<br>" + "<br>".join(lines))
    page.tf(1, 2, TFPlot.of("(d) novel view and TFs", found.novel.inputs, units))
    page.picture(2, 2, "synthesized by the generator", found.novel.image)
    page.picture(3, 2, "volume rendering", found.truth)
    page.save(
        path,
        "(a, b) Volume renderings of random views and TFs, which training learns from; (c) the "
        "networks; (d) an image synthesized from a novel view and TFs.",
    )
