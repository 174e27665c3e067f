"""The approach at a glance (paper, Fig. 2): samples to learn from, networks, a novel image."""

from __future__ import annotations

from dataclasses import dataclass

from model.networks.paper.opacity import OpacityDiscriminator
from model.networks.paper.translation import TranslationDiscriminator
from model.networks.paper.two_stage import TwoStageGenerator
from model.paper.subject import Image, Subject
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs, condition_numbers

TRAINING_SAMPLES = 4


@dataclass(frozen=True, eq=False)
class Pictured:
    """Scene inputs and their image (S, S, 3)."""

    inputs: SceneInputs
    image: Image


@dataclass(frozen=True, eq=False)
class Overview:
    """Content of the figure.

    Attributes
    ----------
    training : tuple of Pictured
        Random training samples, rendered.
    networks : tuple of (str, int)
        Names of the four networks and their numbers of weights.
    novel : Pictured
        Drawn by the generator, from inputs that it has not seen.
    truth : ndarray, shape (S, S, 3)
        The true image of these.
    """

    training: tuple[Pictured, ...]
    networks: tuple[tuple[str, int], ...]
    novel: Pictured
    truth: Image


def approach(subject: Subject, inputs: SceneInputs) -> Overview:
    """Collect what the figure shows."""
    scene, size = subject.generator.scene, subject.generator.card.size
    drawn = [draw_sample(scene, subject.seed, "train", index) for index in range(TRAINING_SAMPLES)]
    network = subject.generator.network
    assert isinstance(network, TwoStageGenerator)
    conditions = condition_numbers(scene)
    parts = (
        ("opacity generator", network.opacity),
        ("opacity discriminator", OpacityDiscriminator(size)),
        ("translation generator", network.translation),
        ("translation discriminator", TranslationDiscriminator(size, conditions)),
    )
    return Overview(
        tuple(Pictured(one, subject.truth(one)) for one in drawn),
        tuple((name, sum(p.numel() for p in part.parameters())) for name, part in parts),
        Pictured(inputs, subject.drawn(inputs)),
        subject.truth(inputs),
    )
