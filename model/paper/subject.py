"""The subject of a figure: a trained model, its volume, and the first view and TF."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.generator.generator import Generator
from model.latent.latent_space import LatentSpace
from model.networks.card import load_card
from model.rendering.renderer import Renderer
from model.samples.sample_rendering import make_renderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import TF_SAMPLES
from model.scene.volume import Volume
from model.volume_files.source import VolumeSource, volume_of

Image = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Subject:
    """A trained model with its volume, and the renderer of its scene's true images."""

    folder: Path
    generator: Generator
    volume: Volume
    space: LatentSpace
    renderer: Renderer

    @property
    def size(self) -> int:
        """Width and height of the model's images in pixels."""
        return self.generator.scene.image_size

    @property
    def seed(self) -> int:
        """Seed of the model's training and hold-out samples."""
        return int(self.generator.card.training.get("dataset_seed", 0))

    @property
    def window(self) -> NDArray[np.bool_]:
        """Whether each of the 256 scalar values is in the scene's window, shape (256,)."""
        inside = np.zeros(TF_SAMPLES, dtype=bool)
        inside[self.generator.scene.window_samples] = True
        return inside

    def drawn(self, inputs: SceneInputs) -> Image:
        """Colours (S, S, 3) of the model's image."""
        return self.generator.render(inputs)[..., :3]

    def truth(self, inputs: SceneInputs) -> Image:
        """Colours (S, S, 3) of the true image."""
        return self.renderer.render(inputs, self.size)[..., :3]

    def close(self) -> None:
        """Release the renderer."""
        self.renderer.close()


def open_subject(folder: Path, source: VolumeSource, device: str = "auto") -> Subject:
    """Load a model and its volume over the model's scalar range."""
    card = load_card(folder)
    volume = volume_of(card.scene, source)
    generator = Generator.load(folder, device)
    renderer = make_renderer(volume, card.scene, threads=None)
    return Subject(folder, generator, volume, LatentSpace.of_model(folder), renderer)
