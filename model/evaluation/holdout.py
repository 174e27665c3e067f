"""Errors of a model and of a nearest-neighbour baseline on the hold-out split.

The baseline distinguishes generalization from memorization (paper, section
6.3.1): for each true image, it is the training image with the smallest RMSE.
"""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model import metrics
from model.errors import DatasetError, VolumeError, require
from model.generator.generator import Generator
from model.networks.generator_network import decode_unit
from model.samples.sample_rendering import render_store
from model.samples.sample_store import BLOCK, SampleBatch, SampleStore
from model.samples.sampling import draw_sample, sample_kind
from model.scene.random_inputs import SHARES
from model.scene.scene import EXACT_LIGHTINGS
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement
from model.training.batch import encode_batch
from model.volume_files.source import VolumeSource, volume_of

RENDER_BATCH = 16

Images = NDArray[np.uint8]


LARGER_IS_BETTER = ("ssim",)  # measures for which larger values are better


@dataclass(frozen=True)
class Evaluation:
    """Errors of each hold-out sample by measure (N,), see :func:`image_errors`."""

    generator: dict[str, NDArray[np.float64]]  # with "opacity_rmse"
    nearest_neighbor: dict[str, NDArray[np.float64]]
    neighbors: int  # number of searched training images

    def to_json(self) -> dict[str, Any]:
        """Return a summary of each measure (:func:`model.metrics.summary`) as plain data."""
        return {
            "count": len(self.generator["rmse"]),
            **_summaries(self.generator),
            "nearest_neighbor": {"count": self.neighbors, **_summaries(self.nearest_neighbor)},
        }


def evaluate(
    generator: Generator,
    store: SampleStore,
    count: int,
    on_progress: Callable[[int], None] = lambda done: None,
) -> Evaluation:
    """Measure a generator on the first hold-out samples of a store of its scene."""
    samples = store.read("holdout", range(min(count, store.count("holdout"))))
    rows = []
    ours = _generator_rows(generator, samples)
    for row in zip(ours, _neighbor_rows(samples, store), strict=True):
        rows.append(row)
        on_progress(len(rows))
    errors, neighbor = (_columns(part) for part in zip(*rows, strict=True))
    return Evaluation(errors, neighbor, store.count("train"))


def generator_errors(generator: Generator, samples: SampleBatch) -> dict[str, NDArray[np.float64]]:
    """Return the generator's errors; see :class:`Evaluation`."""
    return _columns(list(_generator_rows(generator, samples)))


def neighbor_errors(samples: SampleBatch, store: SampleStore) -> dict[str, NDArray[np.float64]]:
    """Return the errors of the nearest training images; see :class:`Evaluation`."""
    return _columns(list(_neighbor_rows(samples, store)))


def _summaries(errors: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
    return {name: metrics.summary(v, name in LARGER_IS_BETTER) for name, v in errors.items()}


def _generator_rows(generator: Generator, samples: SampleBatch) -> Iterator[dict[str, float]]:
    for i, (image, opacity, true_opacity) in enumerate(_render(generator, samples)):
        errors = image_errors(image, samples.rgba[i, ..., :3] / 255)
        yield errors | {"opacity_rmse": metrics.rmse(opacity, true_opacity)}


def _neighbor_rows(samples: SampleBatch, store: SampleStore) -> Iterator[dict[str, float]]:
    for nearest, truth in zip(nearest_images(samples.rgba, store), samples.rgba, strict=True):
        yield image_errors(nearest[..., :3] / 255, truth[..., :3] / 255)


def pictures(generator: Generator, samples: SampleBatch) -> NDArray[np.float32]:
    """Generate images (N, S, S, 3), in [0, 1], of samples."""
    return np.stack([image for image, _, _ in _render(generator, samples)])


def nearest_images(queries: Images, store: SampleStore) -> Images:
    """Find the training image nearest to each query, by RMSE over RGB."""
    require("evaluate")
    from sklearn.metrics import pairwise_distances_argmin_min

    flat = _flatten(queries)
    smallest = np.full(len(queries), np.inf)
    found = np.zeros_like(queries)
    for start in range(0, store.count("train"), 8 * BLOCK):
        stop = min(start + 8 * BLOCK, store.count("train"))
        images = store.read("train", range(start, stop)).rgba
        index, distance = pairwise_distances_argmin_min(flat, _flatten(images))
        closer = distance < smallest
        smallest[closer] = distance[closer]
        found[closer] = images[index[closer]]
    return found


def _flatten(images: Images) -> NDArray[np.float32]:
    return images[..., :3].reshape(len(images), -1).astype(np.float32) / np.float32(255)


def _render(
    generator: Generator, samples: SampleBatch
) -> Iterator[tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]]:
    """Yield colour image (S, S, 3), opacity image and true opacity image (So, So) per sample."""
    size = generator.card.size.opacity_size
    for start in range(0, len(samples), RENDER_BATCH):
        part = samples[start : start + RENDER_BATCH]
        batch = encode_batch(part, generator.scene, size, generator.device)
        yield from zip(
            *generator.image_pairs(batch.inputs),
            decode_unit(batch.opacity_image)[:, 0].cpu().numpy(),
            strict=True,
        )


def image_errors(image: NDArray[Any], color: NDArray[np.float64]) -> dict[str, float]:
    """Return the errors of an image (S, S, 3) against the true one, by measure."""
    return {
        "rmse": metrics.rmse(image, color),
        "emd": metrics.color_emd(image, color),
        "ssim": metrics.ssim(image, color),
        "flip": metrics.flip(image, color),
    }


def _columns(rows: Sequence[dict[str, float]]) -> dict[str, NDArray[np.float64]]:
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


DEFAULT_COUNT = 2000

MOST_NEIGHBORS = 2000  # most training images to render, as many as hold-out samples
DIFFERENTIATED, LEAST_DIFFERENTIATED = 0.1, 5  # share and number of samples differentiated

Progress = Callable[[str, int, int], None]
"""Called with an activity ("rendering", "measuring", "differentiating"), its progress and total."""


@dataclass(frozen=True)
class EvaluationJob:
    """The measurements to make of a model, on `count` hold-out samples.

    The store is any data set of the model's scene. Without one, hold-out samples, and at most as
    many training samples, are rendered again from the model's seed.
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
    """Measure a model; call `on_note` with a sentence if its sensitivities are skipped.

    The result is that of :meth:`Evaluation.to_json`, with "kinds" of opacity TFs, and with
    "sensitivity_agreement" if the volume is available and its light has exact derivatives.
    """
    # By the window's backend, as users see its images.
    generator = Generator.load(job.model, job.device, fastest=True)
    # Before any measurement, to report missing libraries first.
    volume = _volume(job, generator, on_note)
    if job.store is not None:
        store = _store(job, generator, job.store)
        figures = _measure(job, generator, store, on_progress)
    else:
        assert volume is not None
        with tempfile.TemporaryDirectory() as scratch:
            store = _rendered(job, generator, volume, Path(scratch), on_progress)
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
            f"{path}: the data set and the model {job.model} differ in volume, size, light or "
            "kinds of TFs; give a data set that fits, or none."
        )
    return store


def _rendered(
    job: EvaluationJob, generator: Generator, volume: Volume, scratch: Path, on_progress: Progress
) -> SampleStore:
    training = generator.card.training
    # At most the model's own training images.
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
    scene, seed = store.scene, store.seed
    kinds = np.array([sample_kind(scene, seed, "holdout", i) for i in range(len(errors))])
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
    """The model's volume; None if it is not available."""
    try:
        return volume_of(generator.scene, job.volume)
    except VolumeError:
        if job.store is None:
            raise
        on_note("Without the volume, the model's sensitivities are not compared with exact ones.")
        return None
