"""An evaluation job: plain data that says what of a model to measure, and the measuring."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import DatasetError, VolumeError
from model.evaluation.alternatives import compare_alternatives
from model.evaluation.error_profile import Group, error_profile, to_json
from model.evaluation.holdout import evaluate, pictures
from model.evaluation.report import extremes, picture_sheet
from model.generator.generator import Generator
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.samples.sampling import draw_sample, sample_kind
from model.scene.random_tfs import SHARES
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement
from model.volume_files.source import VolumeSource, volume_of

DEFAULT_SENSITIVITIES = 200

COMPARED = 50
"""Hold-out samples that are also drawn by what could be used instead of the model."""

Progress = Callable[[str, int, int], None]
"""Called with an activity ("rendering", "measuring", "comparing", "differentiating"), what is
done of it and in total."""


@dataclass(frozen=True)
class EvaluationJob:
    """The measurements to make of a model.

    Attributes
    ----------
    model : Path
    count : int
        Hold-out samples.
    volume : VolumeSource
        The model's volume; the shipped one where that is it.
    store : Path or None
        The data set that the model was trained on. None renders the hold-out samples, and
        as many training samples as `neighbors`, anew: they follow from the model's seed.
    neighbors : int
        Training images that are searched for nearest neighbours.
    sensitivities : int or None
        Hold-out samples whose sensitivities are compared with the renderer's; None takes
        :data:`DEFAULT_SENSITIVITIES` where the volume is at hand, but under global light.
    workers : int or None
        Rendering processes, one per processor by default.
    device : {"auto", "cpu", "cuda"}
    illustrated : bool
        Whether a picture sheet is made.
    """

    model: Path
    count: int = 2000
    volume: VolumeSource = field(default_factory=VolumeSource)
    store: Path | None = None
    neighbors: int = 2000
    sensitivities: int | None = None
    workers: int | None = None
    device: str = "auto"
    illustrated: bool = False


@dataclass(frozen=True, eq=False)
class EvaluationResult:
    """The outcome of an evaluation job.

    Attributes
    ----------
    figures : dict
        Plain data, see :meth:`model.evaluation.holdout.Evaluation.to_json`; with "profile",
        "kinds" (number of samples and RMSE by kind of the opacity TF), "alternatives" (see
        :mod:`model.evaluation.alternatives`) where the volume is at hand, and
        "sensitivity_agreement" once that is measured.
    profile : dict of list of Group
    sheet : ndarray of uint8, or None
        Worst, median and best samples, where the job is illustrated.
    volume_name : str
    """

    figures: dict[str, Any]
    profile: dict[str, list[Group]]
    sheet: NDArray[np.uint8] | None
    volume_name: str


def run_evaluation(
    job: EvaluationJob,
    on_progress: Progress = lambda activity, done, total: None,
    on_images: Callable[[EvaluationResult], None] = lambda result: None,
    on_note: Callable[[str], None] = lambda note: None,
) -> EvaluationResult:
    """Measure a model.

    Parameters
    ----------
    job : EvaluationJob
    on_progress : callable
    on_images : callable
        Called when all but the sensitivities is measured.
    on_note : callable
        Called with a sentence when the sensitivities are left out.

    Raises
    ------
    CheckpointError, DatasetError, VolumeError, DeviceError
        When the model, its samples or its volume cannot be had.
    """
    # By the backend that the window draws with: its images are what users see.
    generator = Generator.load(job.model, job.device, "auto")
    # Before anything is measured: what is missing had better be said first.
    volume = _volume(job, generator, on_note)
    if job.store is not None:
        store = _store(job, generator, job.store)
        result = _measure(job, generator, store, volume, on_progress)
    else:
        with tempfile.TemporaryDirectory() as scratch:
            store = _render(job, generator, Path(scratch), on_progress)
            result = _measure(job, generator, store, volume, on_progress)
    on_images(result)
    if volume is not None and generator.scene.lighting != "global" and job.sensitivities != 0:
        result.figures["sensitivity_agreement"] = _agreement(job, generator, volume, on_progress)
    return result


def _store(job: EvaluationJob, generator: Generator, path: Path) -> SampleStore:
    """The data set that the model was trained on, with enough hold-out samples."""
    store = SampleStore(path)
    store.require_complete()
    seed = generator.card.training.get("dataset_seed", store.seed)
    if store.scene != generator.scene or store.seed != seed:
        raise DatasetError(
            f"{path}: the data set has another scene or seed than the model {job.model}; "
            "give the one that it was trained on, or none."
        )
    there = store.count("holdout")
    if job.count > there:
        raise DatasetError(
            f"{path}: only {there} hold-out samples are there, not {job.count}; "
            "measure fewer, or add some to the data set.",
            count=str(there),
        )
    return store


def _render(
    job: EvaluationJob, generator: Generator, scratch: Path, on_progress: Progress
) -> SampleStore:
    scene = generator.scene
    volume = volume_of(scene, job.volume)
    training = generator.card.training
    neighbors = min(job.neighbors, int(training.get("samples_stored", job.neighbors)))
    seed = int(training.get("dataset_seed", 0))
    store = SampleStore.create(
        scratch / "samples.zarr", scene, seed, {"holdout": job.count, "train": neighbors}
    )
    total, done = job.count + neighbors, 0

    def count(new: int) -> None:
        nonlocal done
        done += new
        on_progress("rendering", done, total)

    render_store(store, volume, job.workers, count)
    return store


def _measure(
    job: EvaluationJob,
    generator: Generator,
    store: SampleStore,
    volume: Volume | None,
    on_progress: Progress,
) -> EvaluationResult:
    evaluation = evaluate(
        generator, store, job.count, lambda done: on_progress("measuring", done, job.count)
    )
    errors = evaluation.generator["rmse"]
    samples = store.read("holdout", range(len(errors)))
    profile = error_profile(generator.scene, samples, errors)
    sheet = None
    if job.illustrated:
        sheet = picture_sheet(*pictures(generator, store, extremes(errors)))
    kinds = np.array(
        [sample_kind(store.scene, store.seed, "holdout", index) for index in range(len(errors))]
    )
    figures = {
        **evaluation.to_json(),
        "profile": to_json(profile),
        "kinds": {
            kind: {"count": int(of_kind.sum()), "rmse": float(errors[of_kind].mean())}
            for kind, of_kind in ((k, kinds == k) for k in SHARES)
            if of_kind.any()
        },
    }
    if volume is not None:
        first = range(min(COMPARED, len(errors)))
        ways = 5 if store.scene.is_scattering else 4
        inputs = [draw_sample(store.scene, store.seed, "holdout", index) for index in first]
        figures["alternatives"] = compare_alternatives(
            generator,
            job.model,
            volume,
            inputs,
            samples.rgba[: len(first)],
            lambda done: on_progress("comparing", done, ways),
        )
    return EvaluationResult(figures, profile, sheet, generator.scene.volume_name)


def _volume(
    job: EvaluationJob, generator: Generator, on_note: Callable[[str], None]
) -> Volume | None:
    """The volume that the model is compared on; None where it is not at hand."""
    scene = generator.scene
    try:
        return volume_of(scene, job.volume)
    except VolumeError:
        if job.sensitivities:
            raise
        on_note(
            "Without the volume, the model is compared neither with what could be used "
            "instead, nor its sensitivities with the renderer's."
        )
        return None


def _agreement(
    job: EvaluationJob, generator: Generator, volume: Volume, on_progress: Progress
) -> dict[str, Any]:
    """Compare sensitivities with the renderer's on the first hold-out samples."""
    count = job.sensitivities or DEFAULT_SENSITIVITIES
    seed = int(generator.card.training.get("dataset_seed", 0))
    samples = [draw_sample(generator.scene, seed, "holdout", i) for i in range(count)]
    agreement = sensitivity_agreement(
        generator, volume, samples, lambda done: on_progress("differentiating", done, count)
    )
    return {"count": count, **agreement.to_json()}
