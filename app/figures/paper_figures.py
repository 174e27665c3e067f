"""Figures as the paper's (Figs. 1, 2 and 8 to 12), and of studies."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray

from app.figures.plots import (
    AXIS_WIDTH,
    COLORS,
    PICTURE,
    PLOT,
    Disc,
    Page,
    TFPlot,
    label_axis,
    mosaic,
)
from model.evaluation.study import Study
from model.latent.latent_map import LatentMap
from model.paper.edits import PAPER_R, RegionStep, ValueStep
from model.paper.exploration import Exploration, Place
from model.paper.pictures import Compared, Overview
from model.scene.inputs import SceneInputs

GRID = 520  # width of a grid of pictures, which is as high as a picture and a plot
MAP = 440


def save_explorations(path: Path, name: str, units: str, found: list[Exploration]) -> None:
    """Draw explorations below one another: grid, map, hovered picture and its decoded TF."""
    page = Page(
        f"Exploring the opacity TF latent space: {name}",
        [GRID, MAP, PLOT],
        [GRID // 2] * (2 * len(found)),
    )
    for number, one in enumerate(found):
        title = f"({chr(ord('a') + number)}) grid of the rectangle"
        page.picture(2 * number, 0, title, mosaic(one.cells), rows=2)
        _add_explored(page, 2 * number, 1, one, units)
    values = ", ".join(f"{v:.3g}" for v in found[0].map.samples.singular_values)
    page.save(
        path,
        "Grid: pictures of the mean codes of the rectangle's 4 x 4 cells; blue: the weights of the "
        "codes that the picture on the right is interpolated from; below it the TF that this code "
        f"decodes to. {len(found[0].map.codes):,} samples; singular values {values}.",
    )


def _add_explored(page: Page, row: int, column: int, one: Exploration, units: str) -> None:
    """Add map, picture and TF of an exploration, in two rows and columns of a page."""
    hovered, title = one.hovered, "t-SNE of the codes"
    disc = (*hovered.place, hovered.radius)
    page.map(row, column, title, one.map.places, one.brush, [disc], 2)
    page.picture(row, column + 1, "picture of the code", hovered.image)
    page.tf(row + 1, column + 1, decoded_plot("decoded TF", one.inputs, hovered, units))


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
    page.map(2, middle, title, map_.places, None, discs, columns=width)
    page.save(
        path,
        "Top: pictures of interpolated latent codes; middle: the opacity TFs that they decode to; "
        "bottom: where they are, as the Gaussian weights of the interpolation.",
    )


def decoded_plot(title: str, inputs: SceneInputs, place: Place, units: str) -> TFPlot:
    """Return the plot of a place's decoded TF, with the colours of its picture."""
    return replace(TFPlot.of(title, inputs, units), opacity=np.asarray(place.opacities))


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
    # Its grid takes two columns.
    page.picture(2, 0, "(c) grid of the rectangle", mosaic(explored.cells), rows=2, columns=2)
    _add_explored(page, 2, 2, explored, units)
    page.save(
        path,
        "(a) Images synthesized from view and TFs, next to the ground truth. (b) Opacity TF (blue) "
        "with its sensitivity (red), and the field of the values in the red area. (c) Projection "
        "of the latent space of opacity TFs, pictures of the rectangle's cells, and the picture "
        "and decoded TF of the place in blue.",
    )


def save_overview(path: Path, name: str, units: str, found: Overview) -> None:
    """Draw a model's training images, its networks, and a novel image, as a PNG file."""
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


def save_region_edits(
    path: Path, name: str, units: str, window: NDArray[np.bool_], steps: list[RegionStep]
) -> None:
    """Draw the region sensitivity plots and what the two edits did, as a PNG file."""
    page = Page(
        f"Region sensitivity plots: {name}", [PICTURE, PICTURE, PLOT], [PICTURE] * len(steps)
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
            value = f"{step.mode.mean:.4g} {units}".rstrip()
            said.append(f"{value} ({ours:.3f}, {true:.3f})")
    page.save(
        path,
        "Blue: opacity TF; red: how the white region's colours change with an edit (Eq. 11, RMS "
        "over its pixels); dashed: the mode added next. Modes were added at "
        f"{' and '.join(said)}; in brackets the region's RMS change, learned and true.",
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
            f"field of {field.value:.4g} {units}".rstrip(),
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
        "Blue: opacity TF; red: sensitivity of the whole image; red area: Gaussian weights of the "
        "fields of neighbouring values; dashed: the mode added next. The colours of all values' "
        "fields have one scale. Each field is opaque from the end of its own scale on: at "
        f"{' and '.join(ends)} of the colours' scale (change of pixel value per +.01 opacity).",
    )


CURVE_WIDTH, CURVE_HEIGHT = 380, 340

MEASURES = (("opacity_rmse", "opacity image RMSE"), ("rmse", "image RMSE"), ("emd", "colour EMD"))


def save_side_by_side(
    path: Path, study: Study, result: dict[str, Any], found: dict[str, NDArray[np.floating]]
) -> None:
    """Draw the same hold-out samples by each model, one column per model, as a PNG file."""
    rows = len(next(iter(found.values())))
    page = Page(study.title, [PICTURE] * len(found), [PICTURE] * rows)
    for column, (label, images) in enumerate(found.items()):
        for row, image in enumerate(images):
            page.picture(row, column, "" if row else label, image)
    page.save(path, f"{result['volume']}, lighting {result['lighting']}; hold-out samples.")


def save_error_curves(path: Path, study: Study, result: dict[str, Any]) -> None:
    """Draw errors over the number that names each variant, and the paper's, as a PNG file."""
    page = Page(study.title, [CURVE_WIDTH] * len(MEASURES), [CURVE_HEIGHT])
    names = [variant.label for variant in study.variants]
    places = np.arange(len(names))
    for column, (measure, title) in enumerate(MEASURES):
        plot = page.plot(0, column, title)
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
    page.save(path)
