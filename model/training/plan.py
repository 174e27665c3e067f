"""Inputs of a training run, and its progress reports."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch

from model.errors import TrainingError
from model.networks.names import Precision
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.training.options import PRESETS, Budget, TrainingOptions
from model.training.sources import SampleSource
from model.training.stage import Losses
from model.training.warm_start import WarmStart


@dataclass(frozen=True)
class TrainingPlan:
    """Inputs of a training run: samples, networks, recipe, budget and output folder.

    Attributes
    ----------
    preset : str
        Name of the preset, for the record.
    start : WarmStart, optional
        A trained model whose weights are the initial ones; random by default.
    precision : {"float32", "bfloat16"}
        Of the layers of optimization steps under autocast; weights are float32.
    interval : float
        Seconds between checkpoints.
    """

    source: SampleSource
    preset: str
    size: NetworkSize
    options: TrainingOptions
    budget: Budget
    folder: Path
    device: torch.device
    start: WarmStart | None = None
    precision: Precision = "float32"
    interval: float = 60.0

    def recipe(self) -> dict[str, Any]:
        """Return all settings that must not change when a run is resumed, as plain data."""
        return {
            "preset": self.preset,
            "size": asdict(self.size),
            **self.source.recipe(),
            "options": self.options.to_json(),
            **({} if self.start is None else {"start": self.start.digest}),
        }

    def check_recipe(self, found: dict[str, Any]) -> None:
        """Raise :class:`model.errors.TrainingError` if the run in the folder has another recipe."""
        changed = _differences(_plain(self.recipe()), found)
        if changed:
            raise TrainingError(
                f"{self.folder}: the run to resume has {', '.join(changed)}; "
                "give the options that it was started with."
            )


def check_image_size(size: NetworkSize, scene: Scene) -> None:
    """Raise :class:`model.errors.TrainingError` unless networks draw as large as samples are."""
    if size.image_size == scene.image_size:
        return
    fitting = [name for name, other in PRESETS.items() if other.image_size == scene.image_size]
    raise TrainingError(
        f"The samples have {scene.image_size} pixels but the network draws {size.image_size}; "
        "choose another preset, or make a data set with images of that size.",
        **({"preset": fitting[0]} if fitting else {}),
    )


@dataclass(frozen=True)
class TrainingReport:
    """Progress of a run after an optimization step, for a progress bar.

    Attributes
    ----------
    spent : float
        Fraction of the whole budget used, 0..1.
    metrics : dict of float
        Most recent hold-out metrics; empty before the first measurement.
    notice : str
        A message to show once; usually empty.
    """

    stage: str
    spent: float
    seconds: float
    samples: int
    losses: Losses
    metrics: dict[str, float]
    notice: str = ""


def _differences(asked: dict[str, Any], found: dict[str, Any], path: str = "") -> list[str]:
    """List differences between two recipes, such as "options.seed 1, not 0"."""
    changed = []
    for name in asked | found:
        value, other = asked.get(name), found.get(name)
        if path + name == "scene.volume_name":
            # A display name only: a renamed file is the same volume.
            continue
        if isinstance(value, dict) and isinstance(other, dict):
            changed += _differences(value, other, f"{path}{name}.")
        elif other != value:
            changed.append(f"{path}{name} {other}, not {value}")
    return changed


def _plain(recipe: dict[str, Any]) -> dict[str, Any]:
    """Return a recipe as read back from JSON, with lists instead of tuples."""
    plain: dict[str, Any] = json.loads(json.dumps(recipe))
    return plain
