"""A training job: plain data that says all about a run.

The command line builds one from its options. Importing it is quick: what trains is
in :mod:`model.training.trainer`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from model.errors import TrainingError
from model.networks.names import PrecisionChoice
from model.networks.size import NetworkSize
from model.scene.scene import Lighting, Scene, TFFamily
from model.scene.transfer_function import Range
from model.scene.volume import Volume
from model.training.options import PRESETS, Budget, TrainingOptions
from model.volume_files.source import VolumeSource


@dataclass(frozen=True)
class TrainingJob:
    """Description of a training run: data, networks, recipe, budget and output folder.

    Settings that contradict each other or have no effect raise a :class:`TrainingError`.
    """

    out: Path
    volume: VolumeSource = field(default_factory=VolumeSource)
    # A stored data set; None renders samples during training.
    store: Path | None = None
    # A name of `PRESETS`; the width is a fraction of the paper's channels, instead of the preset's.
    preset: str = "compact"
    color_attention: bool = False
    width: float | None = None
    # Whether to use the paper's recipe without additions; settings change it.
    faithful: bool = False
    settings: tuple[str, ...] = ()
    minutes: float | None = None
    samples: int | None = None
    # Of samples that are rendered during training.
    lighting: Lighting = "none"
    movable_light: bool = False
    tf_family: TFFamily = "drawn"
    window: Range | None = None
    up: str = ""
    reuse: float | None = None
    # Folder of a trained model to start from.
    start: Path | None = None
    seed: int = 0
    # Rendering threads, one per processor by default.
    workers: int | None = None
    device: str = "auto"
    precision: PrecisionChoice = "auto"
    # Whether to resume the run in the folder.
    resume: bool = False

    def __post_init__(self) -> None:
        without_effect = {
            "lighting": self.lighting != "none",
            "movable light": self.movable_light,
            "TF family": self.tf_family != "drawn",
            "window": self.window is not None,
            "up axis": self.up != "",
            "range": self.volume.scalar_range is not None,
            "scale": self.volume.scale is not None,
            "reuse": self.reuse is not None,
            "workers": self.workers is not None,
        }
        given = [name for name, is_given in without_effect.items() if is_given]
        if self.store is not None and given:
            raise TrainingError(
                f"With a stored data set the {' and '.join(given)} would have no effect: it is "
                "rendered already; leave that out, or the data set."
            )
        if self.movable_light and self.lighting == "none":
            raise TrainingError(
                "An unlit scene has no light that could be moved; choose a lighting.",
                lighting="direct",
            )
        if self.start is not None and self.start.resolve() == self.out.resolve():
            raise TrainingError(
                f"{self.out}: training would write over the model that it starts from; "
                "choose another folder."
            )
        # What is wrong with either had better be said before anything is read.
        _ = self.budget, self.options
        if self.color_attention and self.faithful:
            raise TrainingError(
                "Colours are looked up in a variant of the paper's networks, which the paper's own "
                "recipe does not have; leave one of the two out."
            )

    @property
    def size(self) -> NetworkSize:
        """Size of the networks; without additions to the paper's if `faithful`."""
        size = PRESETS[self.preset]
        size = replace(size, width=self.width or size.width, color_attention=self.color_attention)
        if not self.faithful:
            return size
        return replace(size, modulation=False, opacity_modulation=False, deep_codec=False)

    @property
    def options(self) -> TrainingOptions:
        """The recipe, with the job's seed and settings."""
        recipe = TrainingOptions.faithful() if self.faithful else TrainingOptions()
        return replace(recipe, seed=self.seed).with_settings(self.settings)

    @property
    def budget(self) -> Budget:
        """The training budget, in minutes or samples."""
        return Budget(self.minutes, self.samples)

    def scene_of(self, volume: Volume) -> Scene:
        """Scene in which a volume is learned whose samples are made meanwhile."""
        size, light = self.size.image_size, self.lighting
        choices = self.movable_light, self.tf_family, self.up
        return Scene.of(volume, size, light, self.window, "raycast", *choices)
