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
from model.evaluation.alternatives import compare_alternatives, is_drawn_by_vtk
from model.evaluation.error_profile import Group, error_profile, to_json
from model.evaluation.forecast import EvaluationParts, forecast_seconds
from model.evaluation.holdout import evaluate, pictures
from model.evaluation.report import extremes, picture_sheet
from model.generator.generator import Generator
from model.networks.card import ModelCard
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.samples.sampling import draw_sample, sample_kind
from model.scene.random_tfs import SHARES
from model.scene.scene import EXACT_LIGHTINGS
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement
from model.volume_files.source import VolumeSource, volume_of

DEFAULT_COUNT = 2000
"""Hold-out samples for which the numbers below are; fewer samples have proportionally fewer."""

DEFAULT_NEIGHBORS = 2000

DEFAULT_SENSITIVITIES = 200

COMPARED = 50
"""Hold-out samples that are also drawn by what could be used instead of the model."""

LEAST = 5
"""Least number of samples of a part, if there are so many."""

Progress = Callable[[str, int, int], None]
"""Called with an activity ("rendering", "measuring", "comparing", "differentiating"), what is
done of it and in total."""


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
        on the same samples. None renders the hold-out samples, and as many training samples
        as `neighbors`, anew: they follow from the model's seed.
    neighbors : int or None
        Training images that are rendered, and searched for nearest neighbours; None takes as
        many as hold-out samples, at most :data:`DEFAULT_NEIGHBORS`.
    sensitivities : int or None
        Hold-out samples whose sensitivities are compared with the renderer's; None takes a
        tenth of them, at most :data:`DEFAULT_SENSITIVITIES`, where the volume is at hand, but
        in soft light and shadows.
    workers : int or None
        Rendering processes, one per processor by default.
    device : {"auto", "cpu", "cuda"}
    illustrated : bool
        Whether a picture sheet is made.
    """

    model: Path
    count: int = DEFAULT_COUNT
    volume: VolumeSource = field(default_factory=VolumeSource)
    store: Path | None = None
    neighbors: int | None = None
    sensitivities: int | None = None
    workers: int | None = None
    device: str = "auto"
    illustrated: bool = False

    def parts(self, card: ModelCard, stored_images: int | None, at_hand: bool) -> EvaluationParts:
        """Return the numbers of samples in all parts.

        Parameters
        ----------
        card : ModelCard
            The model's.
        stored_images : int or None
            Training images of the data set; None where samples are rendered.
        at_hand : bool
            Whether the volume is.
        """
        neighbors = stored_images
        if neighbors is None:
            wanted = self._share(DEFAULT_NEIGHBORS) if self.neighbors is None else self.neighbors
            # No more than the model has learned from.
            neighbors = min(wanted, int(card.training.get("samples_stored", wanted)))
        differentiated = self.sensitivities
        if differentiated is None:
            differentiated = self._share(DEFAULT_SENSITIVITIES)
        return EvaluationParts(
            measured=self.count,
            neighbors=neighbors,
            rendered=self.count + neighbors if stored_images is None else 0,
            compared=self._share(COMPARED) if at_hand else 0,
            differentiated=differentiated
            if at_hand and card.scene.lighting in EXACT_LIGHTINGS
            else 0,
        )

    def _share(self, default: int) -> int:
        """Return the number that goes with the count, where `default` goes with its default."""
        wanted = -(-default * self.count // DEFAULT_COUNT)
        return min(max(wanted, LEAST), self.count, default)


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
    sheet : ndarray of uint8, or None
        Worst, median and best samples, where the job is illustrated.
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
    on_forecast: Callable[[float], None] = lambda seconds: None,
) -> EvaluationResult:
    """Measure a model.

    Parameters
    ----------
    on_images : callable
        Called when all but the sensitivities is measured.
    on_note : callable
        Called with a sentence when the sensitivities are left out.
    on_forecast : callable
        Called, before most of the work, with the seconds that it will take.

    Raises
    ------
    CheckpointError, DatasetError, VolumeError, DeviceError
        When the model, its samples or its volume cannot be had.
    """
    # By the backend that the window draws with: its images are what users see.
    generator = Generator.load(job.model, job.device, "auto", "auto")
    # Before anything is measured: what is missing had better be said first.
    volume = _volume(job, generator, on_note)
    store = None if job.store is None else _store(job, generator, job.store)
    stored_images = None if store is None else store.count("train")
    parts = job.parts(generator.card, stored_images, volume is not None)
    pair = None if store is None else store.read("holdout", range(2))
    on_forecast(forecast_seconds(generator, volume, parts, pair, job.workers))
    if store is not None:
        result = _measure(job, parts, generator, store, volume, on_progress)
    else:
        assert volume is not None
        with tempfile.TemporaryDirectory() as scratch:
            store = _render(job, parts, generator, volume, Path(scratch), on_progress)
            result = _measure(job, parts, generator, store, volume, on_progress)
    on_images(result)
    if volume is not None and parts.differentiated:
        count = parts.differentiated
        result.figures["sensitivity_agreement"] = _agreement(
            generator,
            volume,
            store.seed,
            count,
            lambda done: on_progress("differentiating", done, count),
        )
    return result


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
    job: EvaluationJob,
    parts: EvaluationParts,
    generator: Generator,
    volume: Volume,
    scratch: Path,
    on_progress: Progress,
) -> SampleStore:
    seed = int(generator.card.training.get("dataset_seed", 0))
    store = SampleStore.create(
        scratch / "samples.zarr",
        generator.scene,
        seed,
        {"holdout": parts.measured, "train": parts.neighbors},
    )
    total, done = parts.rendered, 0

    def count(new: int) -> None:
        nonlocal done
        done += new
        on_progress("rendering", done, total)

    render_store(store, volume, job.workers, count)
    return store


def _measure(
    job: EvaluationJob,
    parts: EvaluationParts,
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
        first = range(parts.compared)
        ways = 4 if is_drawn_by_vtk(store.scene) else 3
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
        if job.sensitivities or job.store is None:
            raise
        on_note(
            "Without the volume, the model is compared neither with what could be used "
            "instead, nor its sensitivities with the renderer's."
        )
        return None


def _agreement(
    generator: Generator, volume: Volume, seed: int, count: int, on_progress: Callable[[int], None]
) -> dict[str, Any]:
    """Compare sensitivities with the renderer's on the first hold-out samples of a seed."""
    samples = [draw_sample(generator.scene, seed, "holdout", i) for i in range(count)]
    agreement = sensitivity_agreement(generator, volume, samples, on_progress)
    return {"count": count, **agreement.to_json()}
