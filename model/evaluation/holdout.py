"""Errors of a model and of a nearest-neighbour baseline on the hold-out split.

The baseline distinguishes generalization from memorization (paper, section
6.3.1): for each true image, it is the training image with the smallest RMSE.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model import metrics
from model.errors import require
from model.generator.generator import Generator
from model.networks.encoding import decode_unit
from model.samples.sample_store import BLOCK, SampleBatch, SampleStore
from model.training.batch import encode_batch

RENDER_BATCH = 16

Images = NDArray[np.uint8]


LARGER_IS_BETTER = ("ssim",)
"""Measures for which larger values are better."""


@dataclass(frozen=True)
class Evaluation:
    """Errors per hold-out sample, arrays of shape (N,).

    Attributes
    ----------
    generator : dict of ndarray
        ``rmse``, ``emd``, ``ssim``, ``flip``, ``masked_rmse`` and ``opacity_rmse``.
    nearest_neighbor : dict of ndarray
        The same without ``opacity_rmse``.
    neighbors : int
        Number of training images that were searched.
    """

    generator: dict[str, NDArray[np.float64]]
    nearest_neighbor: dict[str, NDArray[np.float64]]
    neighbors: int

    @property
    def count(self) -> int:
        """Number of hold-out samples."""
        return len(self.generator["rmse"])

    def to_json(self) -> dict[str, Any]:
        """Return a summary of each measure (:func:`model.metrics.summary`) as plain data."""
        return {
            "count": self.count,
            **_summaries(self.generator),
            "nearest_neighbor": {
                "count": self.neighbors,
                **_summaries(self.nearest_neighbor),
            },
        }


def evaluate(
    generator: Generator,
    store: SampleStore,
    count: int,
    on_progress: Callable[[int], None] = lambda done: None,
) -> Evaluation:
    """Measure a generator on the first hold-out samples of a store.

    Parameters
    ----------
    store : SampleStore
        Samples of the generator's scene; its training split is searched for
        nearest neighbours.
    count : int
        Number of hold-out samples, at most those in the store.
    on_progress : callable
        Called with the number of samples measured so far.
    """
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
        truth = samples.rgba[i] / 255
        errors = image_errors(image, truth)
        yield errors | {"opacity_rmse": metrics.rmse(opacity, true_opacity)}


def _neighbor_rows(samples: SampleBatch, store: SampleStore) -> Iterator[dict[str, float]]:
    for nearest, truth in zip(nearest_images(samples.rgba, store), samples.rgba, strict=True):
        yield image_errors(nearest[..., :3] / 255, truth / 255)


def pictures(
    generator: Generator, store: SampleStore, indices: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return true and generated images (N, S, S, 3), in [0, 1], of chosen hold-out samples."""
    samples = store.read("holdout", range(int(indices.max()) + 1))[indices]
    images = [image for image, _, _ in _render(generator, samples)]
    return samples.rgba[..., :3] / 255, np.stack(images).astype(np.float64)


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


def image_errors(image: NDArray[Any], truth: NDArray[np.float64]) -> dict[str, float]:
    """Return the errors of an image (S, S, 3) against the true one (S, S, 4), by measure."""
    color, opacity = truth[..., :3], truth[..., 3]
    return {
        "rmse": metrics.rmse(image, color),
        "masked_rmse": metrics.masked_rmse(image, color, opacity),
        "emd": metrics.color_emd(image, color),
        "ssim": metrics.ssim(image, color),
        "flip": metrics.flip(image, color),
    }


def _columns(rows: Sequence[dict[str, float]]) -> dict[str, NDArray[np.float64]]:
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}
