"""A study's results: a table with the paper's numbers, and pictures by all of its models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.evaluation.holdout import nearest_images, pictures
from model.evaluation.study import MEASURES, Study, StudyPlan, Variant
from model.generator.generator import Generator
from model.metrics import clearly_seen
from model.networks.card import MODEL_FILE
from model.training.options import TrainingOptions


def study_table(study: Study, result: dict[str, Any]) -> list[list[str]]:
    """Return the results and the paper's numbers as rows of cells, the heading first."""
    heading = ["", "samples", "RMSE", "EMD", "SSIM", "opacity RMSE", "cosine image", "blocks"]
    rows = [[*heading, "paper's RMSE", "EMD"]]
    neighbor = result["nearest_neighbor"]
    label = f"nearest of {neighbor['count']:,}"
    rows.append([label, "", *_cells(neighbor), *_paper(study.neighbor)])
    for variant in study.variants:
        row = result["variants"][variant.name]
        seen = f"{row['samples_seen']:,}" if "samples_seen" in row else ""
        label = f"{variant.label} (collapsed)" if "collapsed" in row else variant.label
        rows.append([label, seen, *_cells(row), *_paper(variant.paper)])
    return rows


def markdown(study: Study, result: dict[str, Any]) -> str:
    """Return the table in Markdown, with the study's settings above and the recipe beneath."""
    heading, *rows = study_table(study, result)
    budget = (
        f"{result['minutes']:g} minutes"
        if result["minutes"] is not None
        else f"{result['samples']:,} samples"
    )
    lines = [
        f"{study.title}. {result['volume']}, lighting {result['lighting']}, preset "
        f"{result['preset']} ({result['image_size']} x {result['image_size']}), "
        f"{budget} for each, {result['holdout_count']} hold-out samples. "
        f"Paper: {study.paper}.",
        "",
        *(f"| {' | '.join(cells)} |" for cells in (heading, ["---"] * len(heading), *rows)),
    ]
    for variant in study.variants:
        why = result["variants"][variant.name].get("collapsed")
        if why is not None:
            lines += ["", f"{variant.label} collapsed, and was measured as far as it came. {why}"]
    for line in recipe_lines(study, result):
        lines += ["", line]
    return "\n".join(lines) + "\n"


def recipe_lines(study: Study, result: dict[str, Any]) -> list[str]:
    """Return the recipe of all variants, and what each changes, as two sentences."""
    options = TrainingOptions.from_json(result["options"])
    changes = "; ".join(
        f"{variant.label}: {', '.join(parts)}"
        for variant in study.variants
        if (parts := _changes(variant, options))
    )
    return [
        f"Recipe of all: {', '.join(_settings(options.to_json()))}.",
        f"Changed by each: {changes}.",
    ]


def _changes(variant: Variant, options: TrainingOptions) -> list[str]:
    dimension = variant.latent_dim
    codes = [] if dimension is None else [f"codes of {dimension} numbers"]
    return [*variant.changes(options), *codes]


def _settings(data: dict[str, Any], prefix: str = "") -> list[str]:
    """Return all options as settings of the command line."""
    settings = []
    for name, value in data.items():
        if isinstance(value, dict):
            settings += _settings(value, f"{prefix}{name}.")
        else:
            text = str(value).lower() if isinstance(value, bool) else f"{value:g}"
            settings.append(f"{prefix}{name}={text}")
    return settings


def _cells(row: dict[str, Any]) -> list[str]:
    """Cells of a row's errors and cosines; empty if not measured."""
    return [
        *(_number(row.get(name), 4 if name == "emd" else 3) for name in MEASURES),
        *(_number(row.get(name), 2) for name in ("image_cosine", "block_cosine")),
    ]


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def _paper(numbers: Sequence[float] | None) -> list[str]:
    return ["", ""] if numbers is None else [f"{number:.3f}" for number in numbers]


PICTURED = 4
"""Samples that are shown."""


@dataclass(frozen=True, eq=False)
class StudyPictures:
    """Images (n, S, S, 3) of some samples: the truth, the nearest training images, each model's."""

    columns: dict[str, NDArray[np.floating]]


def study_pictures(study: Study, plan: StudyPlan, count: int = PICTURED) -> StudyPictures:
    """Draw the first hold-out samples that show something by all models of a finished study."""
    samples = plan.store.read("holdout", range(plan.count))
    shows = clearly_seen(samples.rgba)
    chosen = np.flatnonzero(shows if shows.any() else ~shows)[:count]
    columns: dict[str, NDArray[np.floating]] = {
        "ground truth": samples.rgba[chosen, ..., :3] / 255,
        "nearest neighbour": nearest_images(samples.rgba[chosen], plan.store)[..., :3] / 255,
    }
    for variant in study.variants:
        folder = plan.training(variant).folder
        if (folder / MODEL_FILE).is_file():
            generator = Generator.load(folder, plan.base.device.type)
            columns[variant.label] = pictures(generator, plan.store, chosen)[1]
    return StudyPictures(columns)
