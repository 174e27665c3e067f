"""Where training gets its samples from: a stored data set, or a split of fresh ones."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

from model.errors import DatasetError
from model.samples.sample_store import SampleBatch, SampleStore
from model.samples.sampling import Split
from model.scene.scene import Scene

LEAST_HOLDOUT = 4
"""Hold-out samples without which nobody can say whether codes and images differ."""


class SampleSource(ABC):
    """Samples of one scene: an endless supply to learn from, and a fixed hold-out.

    Attributes
    ----------
    scene : Scene
    seed : int
        Of the samples: the hold-out follows from scene and seed alone.
    """

    scene: Scene
    seed: int

    @abstractmethod
    def first(self, split: Split, count: int) -> SampleBatch:
        """The first samples of a split, `count` at most; the same in every run."""

    @abstractmethod
    def batches(self, stage: int, batch_size: int, seed: int, done: int) -> Iterator[SampleBatch]:
        """Batches of random samples without end.

        Parameters
        ----------
        stage : int
            Stage of the training, from 0.
        batch_size : int
        seed : int
            Of the training run; equal arguments give equal batches.
        done : int
            Number of batches to leave out at the start: those that an earlier
            session has learned from.
        """

    @abstractmethod
    def check(self, batch_size: int) -> None:
        """Raise :class:`model.errors.DatasetError` when there are too few samples."""

    def recipe(self) -> dict[str, Any]:
        """What must not change when a run is resumed, as plain data."""
        return {"scene": self.scene.to_json(), "dataset_seed": self.seed}

    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """What a model's card says of its samples, as plain data."""

    def close(self) -> None:  # noqa: B027
        """Free what the source holds."""


class StoredSource(SampleSource):
    """A sample store on disk, in random order, pass after pass.

    Parameters
    ----------
    store : SampleStore
        Complete.
    """

    def __init__(self, store: SampleStore) -> None:
        self.store = store
        self.scene = store.scene
        self.seed = store.seed

    def first(self, split: Split, count: int) -> SampleBatch:
        """The first samples of a split."""
        return self.store.read(split, range(min(count, self.store.count(split))))

    def batches(self, stage: int, batch_size: int, seed: int, done: int) -> Iterator[SampleBatch]:
        """Batches of random samples, each sample once in a pass."""
        return self.store.shuffled("train", [seed, stage], batch_size, skip=done)

    def check(self, batch_size: int) -> None:
        """Raise :class:`model.errors.DatasetError` when a batch cannot be filled."""
        train, holdout = self.store.count("train"), self.store.count("holdout")
        if train < batch_size or holdout < LEAST_HOLDOUT:
            raise DatasetError(
                f"{self.store.path}: {train} training and {holdout} hold-out samples are too "
                f"few; at least {batch_size} and {LEAST_HOLDOUT} are needed, so render more."
            )
        self.store.require_complete()

    def recipe(self) -> dict[str, Any]:
        """Also how many samples there are: in a data set that has grown, all batches differ."""
        return {**super().recipe(), "samples_stored": self.store.count("train")}

    def summary(self) -> dict[str, Any]:
        """Number of samples and their seed."""
        return {"samples_stored": self.store.count("train"), "dataset_seed": self.seed}
