"""``paper`` and ``study``: the options of the paper's figures, tables and studies."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from app.cli import options
from app.cli.options import option
from model.networks.card import read_header
from model.networks.names import DeviceChoice, PresetName, StudyName
from model.scene.scene import Lighting
from model.scene.view import View
from model.volume_files.source import VolumeSource

Item = Literal[
    "all",
    "teaser",
    "overview",
    "sensitivity",
    "value-fields",
    "exploration",
    "interpolation",
    "qualitative",
    "table1",
    "table2",
    StudyName,
]
"""The paper's figures and tables."""

QUICK_COUNT = 12  # hold-out samples of `--quick`


@dataclass(frozen=True, kw_only=True)
class Paper:
    """Repeat the paper's figures and tables, from a trained model or small studies."""

    item: Item = options.argument("A figure or table of the paper, or all of them.", metavar="ITEM")
    out: Path = options.folder(help="Folder of pictures and tables, and of the studies' runs.")
    models: list[Path] | None = option(
        "A model of the paper's networks; several are compared in table1, pictures show the first. "
        "(default: those that are shipped)",
        flag="--model",
        check=read_header,
    )
    volume: VolumeSource = options.volume("scalar_range", "scale")
    # The volume fills the pictures.
    view: View = options.view(default=View(30.0, 20.0, 0.0, 0.65), show_default="30,20,0,0.65")
    tf: Path | None = options.tf()
    count: int | None = option(
        "Hold-out samples. (default: 2000 for table1, 200 for pictures, 500 for studies)", min=8
    )
    store: Path | None = options.store(
        help="Samples of the model's volume, made with 'dataset', for the errors and times of "
        "table1. (default: each model's own are rendered)"
    )
    minutes: float = option("Training of each model of a study.", default=20.0, min=0.01)
    quick: bool = option(
        "Few samples and steps, to check in minutes that all works.", default=False
    )
    workers: int | None = options.workers()
    device: DeviceChoice = options.device()

    def run(self) -> None:
        """Make one item, or all."""
        options.late("paper_items").make_items(self)

    def samples(self, usual: int) -> int:
        """Return the number of hold-out samples: the option, or the usual number."""
        return self.count or (QUICK_COUNT if self.quick else usual)


@dataclass(frozen=True, kw_only=True)
class Study:
    """Repeat a study of the paper: baselines, latent-dim or l1-weight. Run again to go on."""

    study: StudyName = options.argument("The study.", metavar="STUDY")
    out: Path = options.folder(help="Folder of samples, runs and table.")
    volume: VolumeSource = options.volume()
    preset: PresetName = option("Size of all networks.", default="draft")
    lighting: Lighting = options.lighting()
    faithful: bool = option("All models by the paper's recipe, see 'train'.", default=False)
    minutes: float | None = option("Budget of each model. (default: 10)")
    samples: int | None = option("Budget of each model in samples seen.")
    images: int = option("Training samples that are rendered first.", default=20_000, min=16)
    count: int = option("Hold-out samples.", default=500, min=1)
    seed: int = options.seed()
    workers: int | None = options.workers()
    device: DeviceChoice = options.device()

    def run(self) -> None:
        """Run the study, or the part that is missing."""
        from model.training.options import TrainingJob

        minutes = 10.0 if self.minutes is None and self.samples is None else self.minutes
        job = TrainingJob(**options.same_named(self, TrainingJob) | {"minutes": minutes})
        work = options.late("paper_items")
        for path in work.study_models(self.study, job, self.images, self.count):
            print(f"{self.study}: {path}")
