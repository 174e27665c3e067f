"""Sources of training samples: the interface, and stored data sets."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

import numpy as np

from model.errors import DatasetError
from model.samples.sample_store import SampleBatch, SampleStore
from model.samples.sampling import Split
from model.scene.scene import Scene

LEAST_HOLDOUT = 4
"""Least number of hold-out samples, needed to detect a collapse of codes or images."""


class SampleSource(ABC):
    """Samples of one scene: an endless stream for training, and a fixed hold-out split.

    Scene and seed alone determine the hold-out split.
    """

    scene: Scene
    seed: int

    @abstractmethod
    def first(self, split: Split, count: int) -> SampleBatch:
        """Return the first samples of a split, at most `count`; the same in every run."""

    @abstractmethod
    def batches(
        self, stage: int, batch_size: int, seed: int, done: int, image_size: int | None = None
    ) -> Iterator[SampleBatch]:
        """Yield batches of random training samples endlessly; equal arguments give equal batches.

        Each stage, from 0, has batches of its own. The first `done`, used by earlier sessions of
        the run, are skipped. Images can be smaller than the scene's.
        """

    @abstractmethod
    def check(self, batch_size: int) -> None:
        """Raise :class:`model.errors.DatasetError` if there are too few samples."""

    def recipe(self) -> dict[str, Any]:
        """Return all properties that must not change when a run is resumed, as plain data."""
        return {"scene": self.scene.to_json(), "dataset_seed": self.seed}

    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """Return a description of the samples for the model's card, as plain data."""

    def close(self) -> None:  # noqa: B027
        """Release threads and other resources."""


class StoredSource(SampleSource):
    """Samples of a store on disk, in repeated passes in random order."""

    def __init__(self, store: SampleStore) -> None:
        self.store = store
        self.scene = store.scene
        self.seed = store.seed

    def first(self, split: Split, count: int) -> SampleBatch:
        """Return the first samples of a split, at most `count`."""
        return self.store.read(split, range(min(count, self.store.count(split))))

    def batches(
        self, stage: int, batch_size: int, seed: int, done: int, image_size: int | None = None
    ) -> Iterator[SampleBatch]:
        """Yield batches of random samples, each sample once per pass."""
        batches = self.store.shuffled("train", [seed, stage], batch_size, skip=done)
        if image_size in (None, self.scene.image_size):
            return batches
        return (reduced(batch, image_size) for batch in batches)

    def check(self, batch_size: int) -> None:
        """Raise :class:`model.errors.DatasetError` if samples are too few or incomplete."""
        train, holdout = self.store.count("train"), self.store.count("holdout")
        if train < batch_size or holdout < LEAST_HOLDOUT:
            raise DatasetError(
                f"{self.store.path}: {train} training and {holdout} hold-out samples are too "
                f"few; at least {batch_size} and {LEAST_HOLDOUT} are needed, so render more."
            )
        self.store.require_complete()

    def recipe(self) -> dict[str, Any]:
        """Include the number of samples: in a data set that has grown, all batches differ."""
        return {**super().recipe(), "samples_stored": self.store.count("train")}

    def summary(self) -> dict[str, Any]:
        """Return the number of training samples and their seed."""
        return {"samples_stored": self.store.count("train"), "dataset_seed": self.seed}


def reduced(samples: SampleBatch, image_size: int) -> SampleBatch:
    """Return samples with images (N, S, S, 4) averaged over blocks to `image_size` pixels."""
    count, side = samples.rgba.shape[:2]
    block = side // image_size
    blocks = samples.rgba.reshape(count, image_size, block, image_size, block, 4)
    means = blocks.mean(axis=(2, 4), dtype=np.float32)
    return SampleBatch(samples.inputs, np.rint(means).astype(np.uint8))
