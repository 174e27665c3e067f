"""Hold-out samples with true and generated images (paper, Figs. 1 and 12), and Fig. 2."""

from dataclasses import dataclass

import numpy as np

from model.evaluation.holdout import generator_errors
from model.metrics import clearly_seen
from model.networks.blocks import parameter_count
from model.networks.paper import OpacityDiscriminator, TranslationDiscriminator, TwoStageGenerator
from model.paper.subject import Image, Subject
from model.samples.sample_rendering import render_samples
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs, condition_numbers

TYPICAL_AT = (0.2, 0.4, 0.5, 0.7)  # shares of samples with a smaller RMSE than the shown ones


@dataclass(frozen=True, eq=False)
class Compared:
    """One hold-out sample: true and generated image (S, S, 3), and its errors by measure."""

    truth: Image
    drawn: Image
    errors: dict[str, float]
    why: str


def compared_samples(subject: Subject, count: int) -> list[Compared]:
    """Measure hold-out samples, and choose four typical ones and two with the paper's artifacts.

    These are a wrong mapping of colours (the largest colour EMD), and a wrong shape (the largest
    RMSE of the opacity image). Nearly black images are avoided.
    """
    scene = subject.generator.scene
    samples = render_samples(subject.renderer, scene, subject.seed, "holdout", range(count))
    errors = generator_errors(subject.generator, samples)
    shows = clearly_seen(samples.rgba)
    usable = np.flatnonzero(shows if shows.any() else ~shows)
    artifacts: dict[int, str] = {}
    for measure, why in (("emd", "colours"), ("opacity_rmse", "shape")):
        order = usable[errors[measure][usable].argsort()[::-1]]
        index = next((int(i) for i in order if int(i) not in artifacts), int(order[0]))
        artifacts[index] = why
    ranked = usable[errors["rmse"][usable].argsort()]
    typical = [int(ranked[int(share * (len(ranked) - 1))]) for share in TYPICAL_AT]
    chosen = [(i, "typical") for i in dict.fromkeys(typical) if i not in artifacts]
    found = []
    for i, why in (*chosen, *artifacts.items()):
        inputs = draw_sample(scene, subject.seed, "holdout", i)
        truth = (samples.rgba[i, ..., :3] / 255).astype(np.float32)
        own = {name: float(values[i]) for name, values in errors.items()}
        found.append(Compared(truth, subject.drawn(inputs), own, why))
    return found


TRAINING_SAMPLES = 4


@dataclass(frozen=True, eq=False)
class Pictured:
    """Scene inputs and their image (S, S, 3)."""

    inputs: SceneInputs
    image: Image


@dataclass(frozen=True, eq=False)
class Overview:
    """The approach at a glance (paper, Fig. 2)."""

    training: tuple[Pictured, ...]
    networks: tuple[tuple[str, int], ...]  # names and numbers of weights of all four
    novel: Pictured  # by the generator, from unseen inputs
    truth: Image  # of these


def approach(subject: Subject, inputs: SceneInputs) -> Overview:
    """Collect the data of the approach's figure."""
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
        tuple((name, parameter_count(part)) for name, part in parts),
        Pictured(inputs, subject.drawn(inputs)),
        subject.truth(inputs),
    )
