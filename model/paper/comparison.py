"""Generated images beside true ones on hold-out samples, artifacts included (paper, Fig. 12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.evaluation.holdout import generator_errors
from model.metrics import clearly_seen
from model.paper.subject import Image, Subject
from model.samples.sample_rendering import render_samples
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs

TYPICAL_AT = (0.2, 0.4, 0.5, 0.7)
"""Shares of the samples with a smaller RMSE than the typical ones that are shown."""


@dataclass(frozen=True, eq=False)
class Compared:
    """One hold-out sample.

    Attributes
    ----------
    truth, drawn : ndarray, shape (S, S, 3)
    errors : dict of float
        "rmse", "emd", "ssim", "flip" and "opacity_rmse".
    why : str
        What it stands for: "typical", or its artifact.
    """

    index: int
    inputs: SceneInputs
    truth: Image
    drawn: Image
    errors: dict[str, float]
    why: str


def compared_samples(subject: Subject, count: int) -> list[Compared]:
    """Measure hold-out samples, and choose four typical ones and two with artifacts.

    The artifacts are the paper's: a wrong mapping of colours (the largest colour EMD), and a
    wrong shape (the largest RMSE of the opacity image). Nearly black images are left out, as long
    as there are others.

    Parameters
    ----------
    count : int
        Samples that are measured.
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
    return [
        _compared(subject, samples.rgba[i], i, {k: float(v[i]) for k, v in errors.items()}, why)
        for i, why in (*chosen, *artifacts.items())
    ]


def _compared(
    subject: Subject, rgba: NDArray[np.uint8], index: int, errors: dict[str, float], why: str
) -> Compared:
    inputs = draw_sample(subject.generator.scene, subject.seed, "holdout", index)
    truth = (rgba[..., :3] / 255).astype(np.float32)
    return Compared(index, inputs, truth, subject.drawn(inputs), errors, why)
