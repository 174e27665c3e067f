"""``train``: its options, and the training job that they describe."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.cli import options
from app.cli.options import option
from model.errors import TrainingError
from model.networks.names import DeviceChoice, PrecisionChoice, PresetName
from model.scene.scene import Lighting, TFFamily
from model.scene.transfer_function import Range
from model.volume_files.source import VolumeSource


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train a generator of one volume's renderings."""

    out: Path = options.folder(help="Folder of run and model.")
    preset: PresetName | None = option(
        "Images of 64, 128 or 256 pixels by the paper's two networks at a quarter of their width, "
        "with a deeper decoder of TFs and features modulated by the codes of view and TFs; or of "
        "256 by the networks as they are in the paper. (default: compact; with --faithful, paper)"
    )
    volume: VolumeSource = options.volume()
    store: Path | None = options.store()
    minutes: float | None = option("Budget in minutes.")
    samples: int | None = option("Budget in samples seen.")
    epochs: float | None = option(
        "Budget in passes of each stage over the samples: those of --dataset, or 200000 that are "
        "rendered. (default with --faithful: 30)",
        min=0.001,
    )
    resume: bool = option("Go on with the run in --out.", default=False)
    start: Path | None = options.model(
        help="Begin with a trained model's weights; with another --seed it sees other samples.",
        flag="--start-from",
        metavar="MODEL",
    )
    faithful: bool = option(
        "The paper's networks, losses, TFs, batches, rates, stages and epochs, nothing added.",
        default=False,
    )
    width: float | None = option(
        "Channels of the networks, as a fraction of the paper's. (default: the preset's)",
        min=0.02,
        max=4,
    )
    settings: list[str] | None = option(
        "Change one number of the recipe, such as opacity_l1_weight=50 or "
        "joint.learning_rate=5e-4; may be repeated.",
        flag="--set",
        metavar="NAME=VALUE",
    )
    reuse: float | None = option(
        "How often each fresh sample is learned from; more takes less rendering. (default: 4, or "
        "more when lit)",
        min=1,
    )
    lighting: Lighting = options.lighting()
    movable_light: bool = options.movable_light()
    tf_family: TFFamily | None = option(
        f"{options.FAMILY_HELP} (default: drawn; with --faithful, paper)"
    )
    window: Range | None = options.window()
    up: str = options.up()
    seed: int = options.seed()
    workers: int | None = options.workers()
    device: DeviceChoice = options.device()
    precision: PrecisionChoice = option(
        "Precision of the training's steps. (auto: the faster one on this machine)", default="auto"
    )

    def run(self) -> None:
        """Train, or go on with a run."""
        from model.training.options import TrainingJob

        job = TrainingJob(**options.same_named(self, TrainingJob) | self._usual())
        if self.resume and not self.out.is_dir():
            raise TrainingError(
                f"{self.out}: there is no training run to resume; start one instead."
            )
        # Imported late: it imports all of the training.
        from app.cli.training_display import train_model

        train_model(job)

    def _usual(self) -> dict[str, Any]:
        """Return fields of the job that depend on several options."""
        # A stored data set already has its TFs.
        of_paper = self.faithful and self.store is None
        budget_is_given = self.minutes is not None or self.samples is not None
        if self.epochs is not None and budget_is_given:
            raise TrainingError("Give one of --epochs, --minutes and --samples.")
        found: dict[str, Any] = {
            "preset": self.preset or ("paper" if self.faithful else "compact"),
            "tf_family": self.tf_family or ("paper" if of_paper else "drawn"),
            "settings": tuple(self.settings or ()),
        }
        if self.epochs is None and not self.faithful:
            return found | ({} if budget_is_given else {"minutes": 60.0})
        return found if budget_is_given else found | self._of_epochs(found["settings"])

    def _of_epochs(self, changes: tuple[str, ...]) -> dict[str, Any]:
        """Return the fields that follow from a number of epochs."""
        from model.training import options as training

        epochs, kind = self.epochs or training.PAPER_EPOCHS, training.TrainingOptions
        recipe = kind.faithful() if self.faithful else kind()
        images, reuse = training.PAPER_IMAGES, self.reuse
        if self.store is not None:
            # Late: with it comes Zarr.
            from model.samples.sample_store import SampleStore

            images = SampleStore(self.store).count("train")
        elif self.faithful and reuse is None:
            # Each image is used as often as in the paper.
            reuse = max(1.0, epochs)
        return {
            "samples": training.samples_of_epochs(epochs, images, recipe.with_settings(changes)),
            # The user's changes come last, so they win.
            "settings": (training.halvings_of_epochs(epochs) if self.faithful else ()) + changes,
            "reuse": reuse,
        }
