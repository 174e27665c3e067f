"""A training job: all options of a run, as plain data, and its recipe."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from model.errors import TrainingError
from model.json_files import build
from model.networks.names import PrecisionChoice
from model.networks.size import NetworkSize
from model.scene.scene import Lighting, Scene, TFFamily
from model.scene.transfer_function import Range
from model.scene.volume import Volume
from model.volume_files.source import VolumeSource

_SMALL = NetworkSize(0.25, modulation=True, deep_codec=True)

PRESETS: dict[str, NetworkSize] = {
    "draft": replace(_SMALL, image_size=64),
    "compact": replace(_SMALL, image_size=128),
    "large": replace(_SMALL, image_size=256),
    "paper": NetworkSize(1.0, image_size=256),
}
"""Network sizes by name: "draft" for experiments, "compact" for CPUs, and the paper's."""


@dataclass(frozen=True)
class StageOptions:
    """Optimization of one stage (paper, section 6, implementation details) by Adam."""

    batch_size: int
    learning_rate: float
    halvings: float

    def __post_init__(self) -> None:
        if self.batch_size < 2:
            raise TrainingError("A batch must have at least 2 samples.")
        if not self.learning_rate > 0:
            raise TrainingError("A learning rate must be above 0.")
        if self.halvings < 0:
            raise TrainingError("The number of halvings must not be negative.")


@dataclass(frozen=True)
class TrainingOptions:
    """The training recipe. Defaults gave the smallest errors; see also :meth:`faithful`.

    Additions to the paper can be switched off by 0.
    """

    # The paper's runs make 30 passes over 200,000 samples. Runs of an hour are far shorter and
    # need more steps: smaller batches, larger rates.
    opacity: StageOptions = StageOptions(16, 4e-4, 3.0)
    translation: StageOptions = StageOptions(16, 4e-4, 3.0)
    small: StageOptions = StageOptions(32, 2e-3, 5.0)
    joint: StageOptions = StageOptions(32, 1e-3, 5.0)
    # Lambda, the weight of the colour image's l1 loss (paper, Eq. 9).
    l1_weight: float = 150.0
    # 1 in the paper.
    decoded_tf_weight: float = 1000.0
    # Random opacity TFs without images in each step's decoded-TF loss: the codec needs far more
    # TFs than can be rendered.
    unrendered_tfs: int = 32
    # Weights within the decoded-TF loss: of the opacity of a thick layer; of smooth edits of the
    # unrendered TFs. Without edits, derivatives by the TF get worse as training goes on.
    thick_layer_weight: float = 0.1
    tf_edit_weight: float = 0.3
    # Weight of an l1 loss on the opacity image.
    opacity_l1_weight: float = 50.0
    # Whether the learning rate rises over the first steps of a stage and then falls along half a
    # cosine, instead of by halvings.
    cosine: bool = True
    # Adam's decay of the squared gradients' average; .999 in the paper. A gradient far larger than
    # those before it changes weights by up to (1 - .5) / sqrt(1 - beta2) times the learning rate,
    # 16 times at .999.
    beta2: float = 0.99
    # Decay per step of the average (EMA) of the generator's weights, which is evaluated and saved.
    average_decay: float = 0.999
    # For layers without batch norm; the paper draws all weights from N(0, .02).
    kaiming_init: bool = True
    # Fraction of each stage after which the discriminator joins; until then the generator is
    # trained by the other losses alone, twice as fast. By default it never joins, as it sharpens
    # textures but increases both RMSE and EMD.
    adversarial_start: float = 1.0
    # Whether both networks are trained at once, by `joint`. The paper first trains the opacity
    # generator, and then freezes it and trains the translation on rendered opacity images.
    one_stage: bool = True
    # Fraction of the budget in which networks trained at once learn colour images of the opacity
    # image's size, by `small`, before those of their own size. The first need a fifth of the time,
    # and teach nearly all.
    small_time_share: float = 0.5
    # Fraction of the budget for the first of the paper's two stages.
    opacity_time_share: float = 0.4
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.adversarial_start <= 1:
            raise TrainingError("The start of the adversarial loss must be from 0 to 1.")
        if min(value for name, value in vars(self).items() if name.endswith("_weight")) < 0:
            raise TrainingError("The weights of the losses must not be negative.")
        if self.unrendered_tfs < 0:
            raise TrainingError("The number of unrendered TFs must not be negative.")
        if not 0 <= self.beta2 < 1:
            raise TrainingError("The decay of the squared gradients must be from 0 to below 1.")
        if not 0 <= self.average_decay < 1:
            raise TrainingError("The decay of the weight average must be from 0 to below 1.")
        if not 0 <= self.small_time_share < 1:
            raise TrainingError("The share of small images must be from 0 to below 1.")
        if not 0 < self.opacity_time_share < 1:
            raise TrainingError("A stage's share of the budget must be between 0 and 1.")

    @classmethod
    def faithful(cls) -> TrainingOptions:
        """Return the paper's recipe, without additions; both of its stages see as many samples."""
        return replace(
            cls(),
            opacity=StageOptions(64, 2e-4, 30 / 5),
            translation=StageOptions(50, 8e-5, 30 / 8),
            decoded_tf_weight=1.0,
            unrendered_tfs=0,
            thick_layer_weight=0.0,
            tf_edit_weight=0.0,
            opacity_l1_weight=0.0,
            cosine=False,
            beta2=0.999,
            average_decay=0.0,
            kaiming_init=False,
            adversarial_start=0.0,
            one_stage=False,
            small_time_share=0.0,
            opacity_time_share=0.5,
        )

    def with_settings(self, settings: Sequence[str]) -> TrainingOptions:
        """Return the options with some of them changed, by settings like "joint.batch_size=8"."""
        data = asdict(self)
        for setting in settings:
            name, _, text = setting.partition("=")
            *stage, last = name.strip().split(".")
            if name.strip() not in (known := flattened(data)):
                raise TrainingError(
                    f"The recipe has no '{name.strip()}'; it has {', '.join(known)}."
                )
            place = data[stage[0]] if stage else data
            place[last] = _like(place[last], setting, text.strip())
        return build(TrainingOptions, data)


@dataclass(frozen=True)
class Budget:
    """Duration of training, either in minutes of wall-clock time or in samples seen."""

    minutes: float | None = None
    samples: int | None = None

    def __post_init__(self) -> None:
        if (self.minutes is None) == (self.samples is None):
            raise TrainingError("Give the budget either in minutes or in samples.")
        limit = self.minutes if self.minutes is not None else self.samples
        if limit is None or not limit > 0 or not math.isfinite(limit):
            raise TrainingError(f"A training budget must be a number above 0, not {limit}.")

    def spent(self, seconds: float, samples: int) -> float:
        """Fraction of the budget used, from 0; at 1 it is exhausted."""
        if self.minutes is not None:
            return seconds / (60 * self.minutes)
        assert self.samples is not None
        return samples / self.samples


def flattened(options: dict[str, Any]) -> dict[str, Any]:
    """Return all options by name; an inner one, such as "joint.batch_size", begins with its own."""
    found: dict[str, Any] = {}
    for name, value in options.items():
        if isinstance(value, dict):
            found |= {f"{name}.{inner}": each for inner, each in flattened(value).items()}
        else:
            found[name] = value
    return found


def _like(value: bool | int | float, setting: str, text: str) -> bool | int | float:
    """Parse a text as a value of the same type as `value`."""
    try:
        if isinstance(value, bool):
            return {"true": True, "false": False}[text.lower()]
        number = type(value)(text)
        if not math.isfinite(number):
            raise ValueError
    except (ValueError, KeyError):
        kind = "true or false" if isinstance(value, bool) else "a number"
        raise TrainingError(
            f"'{setting}' is not understood; give {kind}, as now {value}."
        ) from None
    return number


PAPER_EPOCHS = 30.0  # passes of each stage of the paper's runs
PAPER_IMAGES = 200_000  # training images of the paper's runs
_HALVED_EVERY = {"opacity": 5.0, "translation": 8.0}  # passes per halving, in the paper


def samples_of_epochs(epochs: float, images: int, options: TrainingOptions) -> int:
    """Return the budget in samples seen by all stages."""
    return max(1, round(epochs * images * (1 if options.one_stage else 2)))


def halvings_of_epochs(epochs: float) -> tuple[str, ...]:
    """Return settings that halve the rates as often as in the paper, in so many passes."""
    return tuple(f"{stage}.halvings={epochs / every:g}" for stage, every in _HALVED_EVERY.items())


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
                f"A stored data set is rendered already, so the {' and '.join(given)} would have "
                "no effect; leave that out, or the data set."
            )
        if self.movable_light and self.lighting == "none":
            raise TrainingError(
                "An unlit scene has no light to move; choose a lighting.", lighting="direct"
            )
        if self.start is not None and self.start.resolve() == self.out.resolve():
            raise TrainingError(
                f"{self.out}: training would write over the model that it starts from; "
                "choose another folder."
            )
        # Wrong budgets and options are refused before anything is read.
        _ = self.budget, self.options

    @property
    def size(self) -> NetworkSize:
        """Size of the networks; without additions to the paper's if `faithful`."""
        size = PRESETS[self.preset]
        size = replace(size, width=self.width or size.width)
        return replace(size, modulation=False, deep_codec=False) if self.faithful else size

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
        """Scene of samples that are rendered during training."""
        size, light = self.size.image_size, self.lighting
        choices = self.movable_light, self.tf_family, self.up
        return Scene.of(volume, size, light, self.window, "raycast", *choices)
