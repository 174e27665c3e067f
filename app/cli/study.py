"""``study``: the options of the paper's studies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from app.cli import options
from app.cli.options import option
from model.networks.names import DeviceChoice, PresetName, StudyName
from model.scene.scene import Lighting
from model.volume_files.source import VolumeSource


@dataclass(frozen=True, kw_only=True)
class Study:
    """The paper's studies anew: baselines, latent-dim or l1-weight. Run again to go on."""

    study: StudyName = options.argument("Which one.", metavar="STUDY")
    out: Path = options.folder(help="Folder of samples, runs and table.")
    volume: VolumeSource = options.volume()
    preset: PresetName = option("draft", "Size of all networks.")
    lighting: Lighting = options.lighting()
    faithful: bool = option(False, "All models by the paper's recipe, see 'train'.")
    minutes: float | None = option(None, "Budget of each model. (default: 10)")
    samples: int | None = option(None, "Budget of each model in samples seen.")
    images: int = option(20_000, "Training samples that are rendered first.", min=16)
    count: int = option(500, "Hold-out samples.", min=1)
    seed: int = options.seed()
    workers: int | None = options.workers()
    device: DeviceChoice = options.device()

    def run(self) -> None:
        """Run the study, or what is missing of it."""
        from model.training.options import TrainingJob

        minutes = 10.0 if self.minutes is None and self.samples is None else self.minutes
        job = TrainingJob(**options.same_named(self, TrainingJob) | {"minutes": minutes})
        # Late: with it comes torch.
        from app.cli.study_models import study_models

        for path in study_models(self.study, job, self.images, self.count):
            print(f"{self.study}: {path}")
