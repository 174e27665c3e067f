"""An evaluation job: plain data that says what of a model to measure, and the measuring."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from model.errors import DatasetError, VolumeError
from model.evaluation.holdout import evaluate
from model.generator.generator import Generator
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.samples.sampling import draw_sample, sample_kind
from model.scene.random_tfs import SHARES
from model.scene.scene import EXACT_LIGHTINGS
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement
from model.volume_files.source import VolumeSource, volume_of

DEFAULT_COUNT = 2000

MOST_NEIGHBORS = 2000
"""Training images that are rendered at most, as many as hold-out samples."""

DIFFERENTIATED, LEAST_DIFFERENTIATED = 0.1, 5
"""Share and least number of the samples whose sensitivities are compared."""

Progress = Callable[[str, int, int], None]
"""Called with an activity ("rendering", "measuring", "differentiating"), what is done of it and in
total."""


@dataclass(frozen=True)
class EvaluationJob:
    """The measurements to make of a model.

    Attributes
    ----------
    count : int
        Hold-out samples.
    volume : VolumeSource
        The model's volume; the shipped one where that is it.
    store : Path or None
        A data set of the model's scene, not only its own: several models are then measured
        on the same samples. None renders the hold-out samples, and as many training samples,
        at most :data:`MOST_NEIGHBORS`, anew: they follow from the model's seed.
    workers : int or None
        Rendering processes, one per processor by default.
    device : {"auto", "cpu", "cuda"}
    """

    model: Path
    count: int = DEFAULT_COUNT
    volume: VolumeSource = field(default_factory=VolumeSource)
    store: Path | None = None
    workers: int | None = None
    device: str = "auto"


def run_evaluation(
    job: EvaluationJob,
    on_progress: Progress = lambda activity, done, total: None,
    on_note: Callable[[str], None] = lambda note: None,
) -> dict[str, Any]:
    """Measure a model.

    Parameters
    ----------
    on_note : callable
        Called with a sentence when the sensitivities are left out.

    Returns
    -------
    dict
        Plain data, see :meth:`model.evaluation.holdout.Evaluation.to_json`; with "kinds" (number of
        samples and RMSE by kind of the opacity TF), and "sensitivity_agreement" where the volume is
        at hand and its light has exact derivatives.

    Raises
    ------
    CheckpointError, DatasetError, VolumeError, DeviceError
        When the model, its samples or its volume cannot be had.
    """
    # By the backend that the window draws with: its images are what users see.
    generator = Generator.load(job.model, job.device, fastest=True)
    # Before anything is measured: what is missing had better be said first.
    volume = _volume(job, generator, on_note)
    if job.store is not None:
        store = _store(job, generator, job.store)
        figures = _measure(job, generator, store, on_progress)
    else:
        assert volume is not None
        with tempfile.TemporaryDirectory() as scratch:
            store = _render(job, generator, volume, Path(scratch), on_progress)
            figures = _measure(job, generator, store, on_progress)
    if volume is not None and generator.scene.lighting in EXACT_LIGHTINGS:
        count = min(max(round(DIFFERENTIATED * job.count), LEAST_DIFFERENTIATED), job.count)
        samples = [draw_sample(generator.scene, store.seed, "holdout", i) for i in range(count)]
        agreement = sensitivity_agreement(
            generator, volume, samples, lambda done: on_progress("differentiating", done, count)
        )
        figures["sensitivity_agreement"] = {"count": count, **agreement.to_json()}
    return figures


def _store(job: EvaluationJob, generator: Generator, path: Path) -> SampleStore:
    """A data set of the model's scene with enough hold-out samples."""
    store = SampleStore(path)
    store.require_holdout(job.count)
    if store.scene != generator.scene:
        raise DatasetError(
            f"{path}: the data set has another scene than the model {job.model}; "
            "give one of its volume, size, light and kinds of TFs, or none."
        )
    return store


def _render(
    job: EvaluationJob, generator: Generator, volume: Volume, scratch: Path, on_progress: Progress
) -> SampleStore:
    training = generator.card.training
    # No more than the model has learned from.
    neighbors = min(job.count, MOST_NEIGHBORS, int(training.get("samples_stored", MOST_NEIGHBORS)))
    store = SampleStore.create(
        scratch / "samples.zarr",
        generator.scene,
        int(training.get("dataset_seed", 0)),
        {"holdout": job.count, "train": neighbors},
    )
    done = 0

    def count(new: int) -> None:
        nonlocal done
        done += new
        on_progress("rendering", done, job.count + neighbors)

    render_store(store, volume, job.workers, count)
    return store


def _measure(
    job: EvaluationJob, generator: Generator, store: SampleStore, on_progress: Progress
) -> dict[str, Any]:
    evaluation = evaluate(
        generator, store, job.count, lambda done: on_progress("measuring", done, job.count)
    )
    errors = evaluation.generator["rmse"]
    kinds = np.array(
        [sample_kind(store.scene, store.seed, "holdout", index) for index in range(len(errors))]
    )
    return {
        **evaluation.to_json(),
        "kinds": {
            kind: {"count": int(of_kind.sum()), "rmse": float(errors[of_kind].mean())}
            for kind, of_kind in ((k, kinds == k) for k in SHARES)
            if of_kind.any()
        },
    }


def _volume(
    job: EvaluationJob, generator: Generator, on_note: Callable[[str], None]
) -> Volume | None:
    """The volume whose renderings the model learned; None where it is not at hand."""
    try:
        return volume_of(generator.scene, job.volume)
    except VolumeError:
        if job.store is None:
            raise
        on_note("Without the volume, the model's sensitivities are not compared with exact ones.")
        return None
