"""``evaluate``: hold-out errors of a model and of the nearest training images."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rich.progress import Progress, TaskID

from app.cli.console import about, console, counting, print_table, warn
from app.cli.outputs import write_json, write_text
from model.evaluation.job import EvaluationJob, EvaluationResult, run_evaluation
from model.evaluation.report import AGREEMENTS, MEASURES, html_report
from model.networks.card import MODEL_FILE, add_metrics, load_card


def evaluate_model(
    job: EvaluationJob, json_path: Path | None, report_path: Path | None, record: bool = False
) -> None:
    """Measure the model, print a table, and write JSON, an HTML report and the card when asked."""

    def write(result: EvaluationResult) -> None:
        if json_path is not None:
            write_json(json_path, {"model": str(job.model), **result.figures})
        if report_path is not None and result.sheet is not None:
            title = f"{result.volume_name}: {job.model}"
            page = html_report(title, result.figures, result.profile, result.sheet)
            write_text(report_path, page)

    def images_measured(result: EvaluationResult) -> None:
        bars.end()
        _print(result.figures)
        if record:
            _record(job.model, result.figures)
        write(result)

    with _Bars() as bars:
        result = run_evaluation(job, bars.show, images_measured, console.print, _tell_duration)
    if "sensitivity_agreement" in result.figures:
        agreement = result.figures["sensitivity_agreement"]
        _print_agreement(agreement)
        if record:
            add_metrics(job.model, sensitivity_agreement=agreement)
        write(result)


def _record(folder: Path, figures: dict[str, Any]) -> None:
    """Write the errors into a model's card, where the window and `info` find them."""
    before = load_card(folder).metrics.get("holdout", {})
    means = {name: figures[name]["mean"] for name in MEASURES if name in figures}
    add_metrics(
        folder,
        holdout={**before, **means},
        holdout_count=figures["count"],
        kinds=figures["kinds"],
        **{name: figures[name] for name in ("alternatives",) if name in figures},
    )
    console.print(f"The errors are in {folder / MODEL_FILE}.")


def _tell_duration(seconds: float) -> None:
    warn(f"Measuring takes {about(seconds)} on this machine.")


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


def _print_alternatives(alternatives: dict[str, Any]) -> None:
    title = f"what could be used instead, {alternatives['count']} samples"
    cells = [
        (
            row["name"],
            *(f"{row[key]:.4f}" for key in ("rmse", "ssim", "emd")),
            f"{row['ms']:.1f}",
            f"{row['bytes'] / 1e6:.1f}",
        )
        for row in alternatives["rows"]
    ]
    print_table(title, ("", "image RMSE", "SSIM", "colour EMD", "ms an image", "MB"), cells)
    console.print(alternatives["verdict"])


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
    if "alternatives" in result:
        _print_alternatives(result["alternatives"])
    whole = sum(scale["error"] for scale in result["scales"]) or 1.0
    shares = [f"{scale['error'] / whole:.0%} of {scale['pixels']}" for scale in result["scales"]]
    console.print(f"the squared error, by the size of details in pixels: {', '.join(shares)}")
