"""Inputs of a training run, its precision, and its progress reports."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch

from model.errors import TrainingError
from model.networks.card import ModelCard, read_header
from model.networks.checkpoint import load_model
from model.networks.generator_network import GeneratorNetwork
from model.networks.names import Precision, PrecisionChoice
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.training.options import PRESETS, Budget, TrainingOptions, flattened
from model.training.sources import SampleSource
from model.training.stage import Losses


@dataclass(frozen=True)
class TrainingPlan:
    """Inputs of a training run: samples, networks, recipe, budget and output folder."""

    source: SampleSource
    preset: str
    size: NetworkSize
    options: TrainingOptions
    budget: Budget
    folder: Path
    device: torch.device
    start: WarmStart | None = None
    precision: Precision = "float32"  # of layers under autocast; weights are float32
    interval: float = 60.0  # seconds between two checkpoints

    def recipe(self) -> dict[str, Any]:
        """Return the settings that a resumed run must keep, as plain data."""
        return {
            "preset": self.preset,
            "size": asdict(self.size),
            **self.source.recipe(),
            "options": asdict(self.options),
            **({} if self.start is None else {"start": self.start.digest}),
        }

    def check_recipe(self, found: dict[str, Any]) -> None:
        """Raise :class:`model.errors.TrainingError` if the run in the folder has another recipe."""
        # As read back from JSON, with lists instead of tuples.
        asked = flattened(json.loads(json.dumps(self.recipe())))
        found = flattened(found)
        # A volume's name is for display only: a renamed file is the same volume.
        changed = [
            f"{name} {found.get(name)}, not {asked.get(name)}"
            for name in asked | found
            if asked.get(name) != found.get(name) and name != "scene.volume_name"
        ]
        if changed:
            raise TrainingError(
                f"{self.folder}: the run to resume has {', '.join(changed)}; "
                "give the options that it was started with."
            )


def check_image_size(size: NetworkSize, scene: Scene) -> None:
    """Raise :class:`model.errors.TrainingError` unless networks and samples have one image size."""
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
    """Progress of a run after an optimization step, for a progress bar."""

    stage: str
    spent: float  # fraction of the whole budget used, 0..1
    seconds: float
    samples: int
    losses: Losses
    metrics: dict[str, float]  # the most recent ones on hold-out samples, if any
    notice: str = ""  # to show once


@dataclass(frozen=True)
class WarmStart:
    """A trained model to start from; a resumed run needs the same digest."""

    digest: str
    card: ModelCard
    network: GeneratorNetwork

    @classmethod
    def read(cls, folder: Path) -> WarmStart:
        """Read a model folder."""
        return cls(str(read_header(folder).get("sha256")), *load_model(folder))

    def check(self, size: NetworkSize, scene: Scene) -> None:
        """Refuse a model of another network size or scene; only its images may be smaller."""
        own = self.card.size
        if own.image_size < size.image_size:
            own = replace(own, image_size=size.image_size)
        ours = asdict(size) | _built_for(scene)
        theirs = (asdict(own) | _built_for(self.card.scene)).items()
        different = [(name, value) for name, value in theirs if value != ours[name]]
        differing = [f"{n.replace('_', ' ')} ({value}, not {ours[n]})" for n, value in different]
        if differing:
            raise TrainingError(
                f"The model to start from has another {', '.join(differing)}; "
                "train with what it has, or start from another model."
            )


def _built_for(scene: Scene) -> dict[str, Any]:
    """Scene properties that networks depend on, besides the image size."""
    properties = {name: getattr(scene, name) for name in ("proportions", "view_range", "lighting")}
    # A movable light adds inputs to the networks.
    return {**properties, "movable light": scene.light_range is not None}


BF16 = ("avx512_bf16", "amx_bf16")  # instructions with which a step in bfloat16 is faster


def choose_precision(device: torch.device, asked: PrecisionChoice = "auto") -> Precision:
    """Return the precision that is asked for; for "auto" the faster one on a device."""
    if asked != "auto":
        return asked
    if device.type == "cuda":
        has_bfloat16 = torch.cuda.is_bf16_supported()
    else:
        # Without instructions, a step in bfloat16 takes ten times as long.
        # Older releases of torch do not tell.
        found: dict[str, Any] = getattr(torch.cpu, "get_capabilities", dict)()
        has_bfloat16 = any(found.get(name) for name in BF16)
    return "bfloat16" if has_bfloat16 else "float32"
