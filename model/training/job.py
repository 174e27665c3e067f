"""A training job: plain data that says all about a run.

The command line builds one from its options; a process that is given a job's JSON file does the
same run. Importing it is quick: what trains is in :mod:`model.training.running`.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, get_args

from model.errors import TrainingError, reason
from model.files import write_atomically
from model.json_files import MalformedError, build, read_json
from model.networks.names import Precision
from model.networks.size import NetworkSize
from model.scene.axes import AXES
from model.scene.scene import Lighting, RendererName, Scene, TFFamily
from model.scene.transfer_function import Range
from model.scene.volume import Volume
from model.training.options import PRESETS, Budget, TrainingOptions
from model.volume_files.source import VolumeSource

JOB_VERSION = 3


@dataclass(frozen=True)
class TrainingJob:
    """Description of a training run: data, networks, recipe, budget and output folder.

    Attributes
    ----------
    out : Path
        Folder of the run and its model.
    store : Path or None
        A stored data set; None renders samples during training.
    preset : str
        Name of a network size, see :data:`model.training.options.PRESETS`.
    color_attention : bool
        Whether the networks look colours up in the colour TF, see
        :class:`model.networks.size.NetworkSize`.
    width : float or None
        Number of the networks' channels as a fraction of the paper's, instead of the preset's.
    faithful : bool
        Whether to use the paper's recipe without additions.
    settings : tuple of str
        Changes of the recipe, see :meth:`TrainingOptions.with_settings`.
    samples : int or None
        The budget; exactly one of the two is given.
    lighting, movable_light, tf_family, renderer, window, up, reuse
        Options of samples that are rendered during training; see
        :class:`model.scene.scene.Scene` and
        :class:`model.training.streamed_samples.StreamSource`.
    start : Path or None
        Folder of a trained model to start from.
    workers : int or None
        Number of rendering threads, one per processor by default.
    device : {"auto", "cpu", "cuda"}
    precision : {"auto", "float32", "bfloat16"}
    resume : bool
        Whether to resume the run in the folder.

    Raises
    ------
    TrainingError
        For unknown presets, and for settings that contradict each other or have no effect.
    """

    out: Path
    volume: VolumeSource = field(default_factory=VolumeSource)
    store: Path | None = None
    preset: str = "compact"
    color_attention: bool = False
    width: float | None = None
    faithful: bool = False
    settings: tuple[str, ...] = ()
    minutes: float | None = None
    samples: int | None = None
    lighting: Lighting = "none"
    movable_light: bool = False
    tf_family: TFFamily = "drawn"
    renderer: RendererName = "raycast"
    window: Range | None = None
    up: str = ""
    reuse: float | None = None
    start: Path | None = None
    seed: int = 0
    workers: int | None = None
    device: str = "auto"
    precision: str = "auto"
    resume: bool = False

    def __post_init__(self) -> None:
        if self.preset not in PRESETS:
            raise TrainingError(
                f"The preset '{self.preset}' is unknown; choose {', '.join(PRESETS)}."
            )
        without_effect = {
            "lighting": self.lighting != "none",
            "movable light": self.movable_light,
            "TF family": self.tf_family != "drawn",
            "window": self.window is not None,
            "up axis": self.up != "",
            "range": self.volume.scalar_range is not None,
            "scale": self.volume.scale is not None,
            "reuse": self.reuse is not None,
            "renderer": self.renderer != "raycast",
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
        self._check_values()
        # What is wrong with either had better be said before anything is read.
        _ = self.budget, self.options
        if self.color_attention and self.faithful:
            raise TrainingError(
                "Colours are looked up in a variant of the paper's networks, which the paper's own "
                "recipe does not have; leave one of the two out."
            )

    def _check_values(self) -> None:
        """Refuse values of a wrong kind or outside their limits: a job may come from a file."""
        whole: dict[str, tuple[Any, int]] = {"seed": (self.seed, 0), "workers": (self.workers, 1)}
        for name, (number, least) in whole.items():
            if number is not None and (type(number) is not int or number < least):
                raise TrainingError(f"The {name} is {number!r}; give a whole number from {least}.")
        if self.reuse is not None and not (type(self.reuse) in (int, float) and self.reuse >= 1):
            raise TrainingError(f"The reuse is {self.reuse!r}; give a number from 1.")
        if self.width is not None and not (
            type(self.width) in (int, float) and 0 < self.width <= 4
        ):
            raise TrainingError(f"The width is {self.width!r}; give a number above 0, up to 4.")
        for name in ("color_attention", "faithful", "movable_light", "resume"):
            if not isinstance(getattr(self, name), bool):
                raise TrainingError(f"The job's '{name}' must be true or false.")
        choices: dict[str, tuple[Any, tuple[Any, ...]]] = {
            "lighting": (self.lighting, get_args(Lighting)),
            "renderer": (self.renderer, get_args(RendererName)),
            "TF family": (self.tf_family, get_args(TFFamily)),
            "device": (self.device, ("auto", "cpu", "cuda")),
            "precision": (self.precision, ("auto", *get_args(Precision))),
            "up axis": (self.up, ("", *AXES)),
        }
        for name, (value, allowed) in choices.items():
            if value not in allowed:
                names = ", ".join(map(str, filter(None, allowed)))
                raise TrainingError(f"The {name} '{value}' is unknown; choose {names}.")

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
        return Scene.of(
            volume,
            self.size.image_size,
            self.lighting,
            self.window,
            self.renderer,
            self.movable_light,
            self.tf_family,
            self.up,
        )

    def to_json(self) -> dict[str, Any]:
        """Return the job as plain data."""
        return {"tfscope_job": JOB_VERSION, **_plain(asdict(self))}

    @classmethod
    def from_json(cls, data: Any) -> TrainingJob:
        """Rebuild a job from :meth:`to_json`'s data.

        Raises
        ------
        TrainingError
            When the data does not describe a valid job.
        """
        if not isinstance(data, dict) or data.get("tfscope_job") != JOB_VERSION:
            raise TrainingError(f"It is not a training job of format {JOB_VERSION}.")
        values = {name: value for name, value in data.items() if name != "tfscope_job"}
        try:
            return build(cls, values, exact=True)
        except MalformedError as error:
            raise TrainingError(f"The training job is malformed near {error}.") from error

    def save(self, path: Path) -> None:
        """Write the job as a JSON file.

        Raises
        ------
        TrainingError
            When the file cannot be written.
        """
        try:
            write_atomically(path, (json.dumps(self.to_json(), indent=2) + "\n").encode())
        except OSError as error:
            raise TrainingError(
                f"{path}: the job cannot be written ({reason(error)}); choose another place."
            ) from error

    @classmethod
    def load(cls, path: Path) -> TrainingJob:
        """Read a job from a JSON file.

        Raises
        ------
        TrainingError
            When the file cannot be read or holds no valid job.
        """
        try:
            return cls.from_json(read_json(path))
        except (OSError, ValueError) as error:
            raise TrainingError(f"{path}: the job cannot be read ({error}).") from error
        except TrainingError as error:
            raise TrainingError(f"{path}: {error}") from error


def _plain(value: Any) -> Any:
    """Return data with paths as strings, for JSON."""
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    return str(value) if isinstance(value, Path) else value
