"""``evaluate``: hold-out errors of a model and of the nearest training images."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.cli import options
from app.cli.options import option
from model.errors import require
from model.networks.card import MODEL_FILE, add_metrics, load_card
from model.networks.names import DeviceChoice
from model.volume_files.source import VolumeSource

MEASURES = {
    "rmse": "image RMSE", "emd": "colour EMD", "ssim": "SSIM", "flip": "FLIP",
    "opacity_rmse": "opacity image RMSE", "tf_rmse": "opacity TF RMSE",
}  # fmt: skip
AGREEMENTS = {"image_cosine": "whole image, cosine", "block_cosine": "8 x 8 blocks, cosine"}


@dataclass(frozen=True, kw_only=True)
class Evaluate:
    """Measure a model on hold-out samples, and the nearest training image with it."""

    model: Path = options.model(default=options.REQUIRED)
    count: int = option("Hold-out samples.", default=2000, min=1)
    volume: VolumeSource = options.volume("scalar_range", "scale")
    store: Path | None = options.store()
    json: Path | None = options.output(
        "Also write the result.", ".json", default=None, metavar="OUT.json"
    )
    record: bool = option("Also write the errors into the model's card.", default=False)
    device: DeviceChoice = options.device()
    workers: int | None = options.workers()

    def run(self) -> None:
        """Measure the model, print a table, and write JSON and the card when asked."""
        from app.cli.console import bars
        from app.cli.outputs import write_json

        require("evaluate")
        # Late: with it comes torch.
        from model.evaluation.holdout import EvaluationJob, run_evaluation

        job = EvaluationJob(**options.same_named(self, EvaluationJob))
        with bars() as show:
            figures = run_evaluation(job, show, print)
        _print(figures)
        if self.record:
            _record(self.model, figures)
        if self.json is not None:
            write_json(self.json, {"model": str(self.model), **figures})


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
    print(f"The errors are in {folder / MODEL_FILE}.")


def _print(result: dict[str, Any]) -> None:
    from app.cli.console import print_table

    neighbor = result["nearest_neighbor"]
    statistics = ("mean", "median", "p95")
    heading = [f"{images}\n{s}" for images in ("generator", "nearest") for s in statistics]
    rows = []
    for key, label in MEASURES.items():
        if key not in result:
            continue
        other = neighbor.get(key, {})
        cells = [f"{result[key][s]:.4f}" for s in statistics]
        cells += [f"{other[s]:.4f}" if other else "" for s in statistics]
        rows.append([label, *cells])
    print_table(f"{result['count']} hold-out samples", ["", *heading], rows)
    print(f"p95: 95 % are better; nearest: by RMSE, of {neighbor['count']} training images")
    kinds = [f"{kind} {k['rmse']:.4f} ({k['count']})" for kind, k in result["kinds"].items()]
    print(f"image RMSE by kind of opacity TF (samples): {', '.join(kinds)}")
    if (agreement := result.get("sensitivity_agreement")) is None:
        return
    what = "sensitivity to the opacity TF against the renderer's own"
    parts = ("quartile1", "median", "quartile3")
    rows = [
        [label, *(f"{agreement[key][part]:.2f}" for part in parts)]
        for key, label in AGREEMENTS.items()
    ]
    heading = ["", "quartile 1", "median", "quartile 3"]
    print_table(f"{what}, {agreement['count']} samples", heading, rows)
