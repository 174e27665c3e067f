"""Tables of a study's results and the paper's numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from model.evaluation.study import MEASURES, Study


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
    """Return the table in Markdown, with the study's settings."""
    heading, *rows = study_table(study, result)
    budget = (
        f"{result['minutes']:g} minutes"
        if result["minutes"] is not None
        else f"{result['samples']:,} samples"
    )
    lines = [
        f"{study.title}. {result['volume']}, preset {result['preset']} "
        f"({result['architecture']}, {result['image_size']} x {result['image_size']}), "
        f"{budget} for each, {result['holdout_count']} hold-out samples. "
        f"Paper: {study.paper}.",
        "",
        *(f"| {' | '.join(cells)} |" for cells in (heading, ["---"] * len(heading), *rows)),
    ]
    for variant in study.variants:
        why = result["variants"][variant.name].get("collapsed")
        if why is not None:
            lines += ["", f"{variant.label} collapsed, and was measured as far as it came. {why}"]
    return "\n".join(lines) + "\n"


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
