"""Pictures of a study: the same hold-out samples by all of its models (paper, Figs. 13 and 15)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.evaluation.holdout import nearest_images, pictures
from model.evaluation.study import Study, StudyPlan
from model.generator.generator import Generator
from model.metrics import clearly_seen
from model.networks.card import MODEL_FILE

PICTURED = 4
"""Samples that are shown."""


@dataclass(frozen=True, eq=False)
class StudyPictures:
    """Images of some samples by each way to draw them.

    Attributes
    ----------
    columns : dict of ndarray, shape (n, S, S, 3)
        By label: the truth, the nearest training images, and each variant that has a model.
    """

    columns: dict[str, NDArray[np.floating]]


def study_pictures(study: Study, plan: StudyPlan, count: int = PICTURED) -> StudyPictures:
    """Draw the first hold-out samples that show something by all models of a finished study."""
    samples = plan.store.read("holdout", range(plan.count))
    shows = clearly_seen(samples.rgba)
    chosen = np.flatnonzero(shows if shows.any() else ~shows)[:count]
    columns: dict[str, NDArray[np.floating]] = {
        "ground truth": samples.rgba[chosen, ..., :3] / 255,
        "nearest neighbour": nearest_images(samples.rgba[chosen], plan.store)[..., :3] / 255,
    }
    for variant in study.variants:
        folder = plan.training(variant).folder
        if (folder / MODEL_FILE).is_file():
            generator = Generator.load(folder, plan.base.device.type)
            columns[variant.label] = pictures(generator, plan.store, chosen)[1]
    return StudyPictures(columns)
