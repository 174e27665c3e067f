"""The studies of ``paper``: small ones, whose time is said before they begin."""

from __future__ import annotations

from pathlib import Path

from app.cli.choices import PaperItem
from app.cli.console import about, console
from app.cli.paper_order import PaperOrder
from app.cli.study import StudyOrder, study_models
from model.evaluation.study import STUDIES
from model.training.job import TrainingJob
from model.training.options import TrainingOptions

PRESET = "draft"
"""64 x 64 pixels, as the paper's own study of dimensions has; a quarter of its width."""

SETTINGS = (f"joint.learning_rate={TrainingOptions().small.learning_rate}",)
"""At 64 pixels the rate is that of a run that begins so small."""

IMAGES = 8000
COUNT = 500
QUICK_SAMPLES = 64
QUICK_IMAGES = 64


def make_study(order: PaperOrder, item: PaperItem) -> list[Path]:
    """Run a study, or what is missing of it, in a folder that all studies share.

    Returns
    -------
    list of Path
        Table and figures.
    """
    study = STUDIES[str(item)]
    folder = order.out / ("studies-quick" if order.quick else "studies")
    job = TrainingJob(
        out=folder,
        volume=order.volume,
        preset=PRESET,
        settings=SETTINGS,
        minutes=None if order.quick else order.minutes,
        samples=QUICK_SAMPLES if order.quick else None,
        workers=order.workers,
        device=order.device,
    )
    missing = [v for v in study.variants if not (folder / v.name / "result.json").is_file()]
    if missing and not order.quick:
        seconds = 60 * order.minutes * len(missing)
        console.print(
            f"{item}: {len(missing)} models of {order.minutes:g} minutes each, "
            f"{about(seconds)}, beside rendering and measuring. It can be stopped and go on."
        )
    images = QUICK_IMAGES if order.quick else IMAGES
    return study_models(StudyOrder(str(item), job, images, order.samples(COUNT)))
