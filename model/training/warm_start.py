"""Warm start: training that begins with a trained model's weights."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from model.errors import TrainingError
from model.networks.card import ModelCard, weights_digest
from model.networks.checkpoint import load_model
from model.networks.generator_network import GeneratorNetwork
from model.networks.size import NetworkSize
from model.scene.scene import Scene

BUILT_FOR = ("proportions", "view_range", "lighting")
"""Scene properties that networks depend on, besides the image size."""


@dataclass(frozen=True)
class WarmStart:
    """A trained model to start from.

    Attributes
    ----------
    digest : str
        SHA-256 of its weights; must not change when a run is resumed.
    network : GeneratorNetwork
        In evaluation mode, float32, on the CPU.
    """

    digest: str
    card: ModelCard
    network: GeneratorNetwork

    @classmethod
    def read(cls, folder: Path) -> WarmStart:
        """Read a model folder.

        Raises
        ------
        CheckpointError
            When the folder holds no model that can be read.
        """
        return cls(weights_digest(folder), *load_model(folder))

    def size_of(self, size: NetworkSize) -> NetworkSize:
        """Return a network size with the additions of the model, which a run goes on with."""
        own = self.card.size
        return replace(size, opacity_modulation=own.opacity_modulation)

    def check(self, size: NetworkSize, scene: Scene) -> None:
        """Refuse a model of another network size or an incompatible scene.

        It may have been trained on smaller images: networks grow.

        The volume may be another one of the same proportions, and the light may
        differ: training then still needs less time than from random weights.

        Raises
        ------
        TrainingError
            When they differ; the message names all differences.
        """
        own = self.card.size
        if own.image_size < size.image_size:
            own = replace(own, image_size=size.image_size)
        theirs = asdict(own) | _built_for(self.card.scene)
        ours = asdict(size) | _built_for(scene)
        differing = [
            f"{name.replace('_', ' ')} ({value}, not {ours[name]})"
            for name, value in theirs.items()
            if value != ours[name]
        ]
        if differing:
            raise TrainingError(
                f"The model to start from has another {', '.join(differing)}; "
                "train with what it has, or start from another model."
            )


def _built_for(scene: Scene) -> dict[str, Any]:
    properties = {name: getattr(scene, name) for name in BUILT_FOR}
    # Networks take in as many numbers as images depend on; a movable light adds some.
    return {**properties, "movable light": scene.light_range is not None}
