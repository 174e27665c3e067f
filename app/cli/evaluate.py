"""``evaluate``: hold-out errors of a model and of the nearest training images."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rich.progress import Progress, TaskID

from app.cli.console import console, counting, print_table
from app.cli.outputs import write_json
from model.errors import require
from model.evaluation.job import EvaluationJob, run_evaluation
from model.networks.card import MODEL_FILE, add_metrics, load_card

MEASURES = {
    "rmse": "image RMSE",
    "masked_rmse": "RMSE where opacity > .01",
    "emd": "colour EMD",
    "ssim": "SSIM",
    "flip": "FLIP",
    "opacity_rmse": "opacity image RMSE",
}
AGREEMENTS = {
    "image_cosine": "whole image, cosine",
    "image_rank": "whole image, rank correlation",
    "block_cosine": "8 x 8 blocks, cosine",
    "block_rank": "8 x 8 blocks, rank correlation",
    "single_cosine": "whole image, single bins, cosine",
}


def evaluate_model(job: EvaluationJob, json_path: Path | None, record: bool = False) -> None:
    """Measure the model, print a table, and write JSON and the card when asked."""
    require("evaluate")
    with _Bars() as bars:
        figures = run_evaluation(job, bars.show, console.print)
    _print(figures)
    if "sensitivity_agreement" in figures:
        _print_agreement(figures["sensitivity_agreement"])
    if record:
        _record(job.model, figures)
    if json_path is not None:
        write_json(json_path, {"model": str(job.model), **figures})


def _record(folder: Path, figures: dict[str, Any]) -> None:
    """Write the errors into a model's card, where the window and `info` find them."""
    before = load_card(folder).metrics.get("holdout", {})
    means = {name: figures[name]["mean"] for name in MEASURES if name in figures}
    add_metrics(
        folder,
        holdout={**before, **means},
        holdout_count=figures["count"],
        kinds=figures["kinds"],
        **{name: figures[name] for name in ("sensitivity_agreement",) if name in figures},
    )
    console.print(f"The errors are in {folder / MODEL_FILE}.")


class _Bars:
    """One progress bar after the other, one for each activity."""

    def __init__(self) -> None:
        self._activity = ""
        self._stack = ExitStack()
        self._bar: tuple[Progress, TaskID] | None = None

    def __enter__(self) -> _Bars:
        return self

    def __exit__(self, *exception: object) -> None:
        self.end()

    def end(self) -> None:
        """Leave the present bar as it is."""
        self._stack.close()
        self._activity, self._bar = "", None

    def show(self, activity: str, done: int, total: int) -> None:
        """Show the progress of an activity."""
        if activity != self._activity:
            self.end()
            self._activity = activity
            self._bar = self._stack.enter_context(counting(activity, total))
        assert self._bar is not None
        progress, task = self._bar
        progress.update(task, completed=done)


def _print_agreement(agreement: dict[str, Any]) -> None:
    title = (
        f"sensitivity to the opacity TF against the renderer's own, {agreement['count']} samples"
    )
    parts = ("quartile1", "median", "quartile3")
    cells = [
        (label, *(f"{agreement[key][part]:.2f}" for part in parts))
        for key, label in AGREEMENTS.items()
    ]
    print_table(title, ("", "quartile 1", "median", "quartile 3"), cells)


def _print(result: dict[str, Any]) -> None:
    neighbor = result["nearest_neighbor"]
    statistics = ("mean", "median", "p95")
    heading = [f"{who}\n{s}" for who in ("generator", "nearest") for s in statistics]
    rows = []
    for key, label in MEASURES.items():
        if key not in result:
            continue
        other = neighbor.get(key, {})
        cells = [f"{result[key][s]:.4f}" for s in statistics]
        cells += [f"{other[s]:.4f}" if other else "" for s in statistics]
        rows.append([label, *cells])
    print_table(f"{result['count']} hold-out samples", ["", *heading], rows)
    console.print(f"nearest: the nearest of {neighbor['count']} training images, by RMSE")
    kinds = [f"{kind} {k['rmse']:.4f} ({k['count']})" for kind, k in result["kinds"].items()]
    console.print(f"image RMSE by kind of opacity TF (samples): {', '.join(kinds)}")
