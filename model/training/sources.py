"""Sources of training samples: stored data sets, and samples rendered while training.

Each sample is rendered once, used about `reuse` times while it is among the newest, and discarded.
The samples of a batch depend on its number only, so that runs resume exactly; training waits if
rendering is too slow.
"""

from __future__ import annotations

import threading
from collections.abc import Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import DatasetError
from model.measurements import processors
from model.rendering.renderer import Renderer
from model.samples.sample_rendering import (
    check_volume,
    explained,
    make_renderer,
    own_renderer,
    render_samples,
    rendering_pool,
)
from model.samples.sample_store import BLOCK, SampleBatch, SampleStore
from model.samples.sampling import Split
from model.scene.inputs import encode_inputs
from model.scene.scene import Lighting, Scene
from model.scene.volume import Volume

LEAST_HOLDOUT = 4  # samples, to detect a collapse of codes or images


class StoredSource:
    """Samples of a store on disk, in repeated passes in random order."""

    def __init__(self, store: SampleStore) -> None:
        self.store = store
        self.scene = store.scene
        self.seed = store.seed

    def first(self, split: Split, count: int) -> SampleBatch:
        """Return the first samples of a split, at most `count`; the same in every run."""
        return self.store.read(split, range(min(count, self.store.count(split))))

    def batches(
        self, stage: int, batch_size: int, seed: int, done: int, image_size: int | None = None
    ) -> Generator[SampleBatch]:
        """Yield batches of random samples endlessly, each sample once per pass.

        Equal arguments give equal batches. Each stage, from 0, has its own; the first `done` are
        skipped.
        """
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
        """Return what must not change in a resumed run: in a larger data set, batches differ."""
        return _facts(self) | {"samples_stored": self.store.count("train")}

    def summary(self) -> dict[str, Any]:
        """Return the number of training samples and their seed, for the model's card."""
        return {"samples_stored": self.store.count("train"), "dataset_seed": self.seed}


def reduced(samples: SampleBatch, image_size: int) -> SampleBatch:
    """Return samples with images (N, S, S, 4) averaged over blocks to `image_size` pixels."""
    count, side = samples.rgba.shape[:2]
    block = side // image_size
    blocks = samples.rgba.reshape(count, image_size, block, image_size, block, 4)
    means = blocks.mean(axis=(2, 4), dtype=np.float32)
    return SampleBatch(samples.inputs, np.rint(means).astype(np.uint8))


DEFAULT_REUSE: dict[Lighting, float] = {"none": 4.0, "direct": 16.0, "soft": 8.0}
"""Uses per sample by lighting; rendering then takes at most a quarter of a run on a CPU."""

FIRST_SAMPLES = 512  # number of samples rendered before the first batch
RING_BYTES = 512 << 20
RING_SAMPLES = 8192  # largest number of samples in the ring
PROCESS_RINGS = 4  # times the ring's limits on machines that render in processes
AHEAD_BLOCKS = 8  # rendered ahead; at least two for each thread or process
STAGE_SAMPLES = 1 << 40  # distance between the sample indices of stages, which share no samples


class StreamSource:
    """Samples rendered in the background during training, by threads or by processes.

    Each sample is used `reuse` times on average. Threads share the interpreter's lock with the
    training, which on a GPU holds it nearly always.
    """

    def __init__(
        self,
        volume: Volume,
        scene: Scene,
        seed: int,
        reuse: float | None = None,
        threads: int | None = None,
        processes: bool = False,
    ) -> None:
        self.scene = scene
        self.seed = seed
        self.reuse = reuse or DEFAULT_REUSE[scene.lighting]
        self._volume = volume
        self._threads = threads or processors()
        self._processes = processes
        rings = PROCESS_RINGS if processes else 1
        self._capacity = rings * min(RING_SAMPLES, RING_BYTES // (4 * scene.image_size**2))
        check_volume(volume, scene)

    def first(self, split: Split, count: int) -> SampleBatch:
        """Render the first samples of a split; scene and seed determine them."""
        with closing(make_renderer(self._volume, self.scene, threads=None)) as renderer:
            return render_samples(renderer, self.scene, self.seed, split, range(count))

    def batches(
        self, stage: int, batch_size: int, seed: int, done: int, image_size: int | None = None
    ) -> Generator[SampleBatch]:
        """Yield batches of random samples among the newest; see :class:`StoredSource`.

        Closing the generator ends the rendering.
        """
        fresh = batch_size / self.reuse
        first = max(FIRST_SAMPLES, batch_size)
        newest = first + int(done * fresh)
        oldest = max(0, newest - self._capacity) // BLOCK * BLOCK
        ahead = max(AHEAD_BLOCKS, 2 * self._threads)
        ring = _Ring(self._capacity, stage * STAGE_SAMPLES, oldest, ahead)
        scene = replace(self.scene, image_size=image_size or self.scene.image_size)
        pool = rendering_pool(self._threads, self._volume, scene) if self._processes else None
        render = partial(self._render, ring, scene, pool)
        threads = [
            threading.Thread(target=render, name="samples", daemon=True)
            for _ in range(self._threads)
        ]
        for thread in threads:
            thread.start()
        try:
            number = done
            while True:
                newest = first + int(number * fresh)
                ring.wait_for(newest)
                window = np.arange(max(0, newest - self._capacity), newest)
                rng = np.random.default_rng([seed, stage, number])
                chosen = rng.choice(window, batch_size, replace=len(window) < batch_size)
                yield ring.read(chosen)
                number += 1
        finally:
            ring.close()
            if pool is not None:
                pool.shutdown(wait=False, cancel_futures=True)
            # One that still rendered at the interpreter's end would abort the process.
            for thread in threads:
                thread.join()

    def check(self, batch_size: int) -> None:
        """Do nothing: there are always enough samples."""

    def recipe(self) -> dict[str, Any]:
        """Return what must not change when a run is resumed, as plain data."""
        return _facts(self) | {"reuse": self.reuse, "ring_samples": self._capacity}

    def summary(self) -> dict[str, Any]:
        """Return seed and reuse of the samples, for the model's card."""
        return {"dataset_seed": self.seed, "reuse": self.reuse}

    def _render(self, ring: _Ring, scene: Scene, pool: ProcessPoolExecutor | None) -> None:
        """Render block after block into the ring, until it is closed."""
        try:
            with ExitStack() as stack:
                if pool is not None:
                    render = partial(_from_worker, pool, scene, self.seed)
                else:
                    own = stack.enter_context(closing(make_renderer(self._volume, scene)))
                    render = partial(_rendered, own, scene, self.seed)
                while (block := ring.next_block()) is not None:
                    numbers = range(block.start + ring.offset, block.stop + ring.offset)
                    ring.write(block, render(numbers))
        except BaseException as error:
            ring.fail(error)


SampleSource = StoredSource | StreamSource


def _facts(source: SampleSource) -> dict[str, Any]:
    return {"scene": asdict(source.scene), "dataset_seed": source.seed}


def _rendered(renderer: Renderer, scene: Scene, seed: int, indices: range) -> SampleBatch:
    """Render training samples, and encode their inputs once, not at each use."""
    samples = render_samples(renderer, scene, seed, "train", indices)
    return replace(samples, encoded=encode_inputs(samples.inputs, scene))


def _rendered_here(scene: Scene, seed: int, indices: range) -> SampleBatch:
    return _rendered(own_renderer(), scene, seed, indices)


def _from_worker(pool: ProcessPoolExecutor, scene: Scene, seed: int, indices: range) -> SampleBatch:
    with explained():
        return pool.submit(_rendered_here, scene, seed, indices).result()


class _Ring:
    """Ring buffer of the newest samples, from rendering threads to the trainer."""

    def __init__(self, capacity: int, offset: int, first: int, ahead: int) -> None:
        self._ahead = ahead * BLOCK
        # Blocks rendered ahead must not overwrite samples that are still needed.
        self._slots = -(-capacity // BLOCK) * BLOCK + self._ahead + BLOCK
        self.offset = offset
        self._arrays: dict[str, NDArray[Any]] = {}
        self._changed = threading.Condition()
        self._next = first
        self._wanted = first
        self._finished: set[int] = set()
        self._complete = first
        self._error: BaseException | None = None
        self._closed = False

    def wait_for(self, newest: int) -> None:
        """Wait until all samples below `newest` are rendered, and allow more."""
        with self._changed:
            self._wanted = newest
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._error or self._closed or self._complete >= newest)
            if self._error is not None:
                raise self._error
            if self._closed:
                raise RuntimeError("No more samples are rendered.")

    def next_block(self) -> range | None:
        """Return the next block to render once there is room for it; None when closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._next < self._wanted + self._ahead)
            if self._closed:
                return None
            start = self._next
            self._next += BLOCK
            return range(start, start + BLOCK)

    def write(self, block: range, samples: SampleBatch) -> None:
        """Store a block's samples in place of the oldest ones."""
        with self._changed:
            for name, values in samples.arrays.items():
                if name not in self._arrays:
                    shape = (self._slots, *values.shape[1:])
                    self._arrays[name] = np.empty(shape, values.dtype)
                start = block.start % self._slots
                self._arrays[name][start : start + BLOCK] = values
            self._finished.add(block.start)
            while self._complete in self._finished:
                self._finished.remove(self._complete)
                self._complete += BLOCK
            self._changed.notify_all()

    def read(self, indices: NDArray[np.int64]) -> SampleBatch:
        """Copy samples by their index in the stage."""
        slots = indices % self._slots
        return SampleBatch.of({name: array[slots] for name, array in self._arrays.items()})

    def fail(self, error: BaseException) -> None:
        """Pass an error on to the thread that waits for samples."""
        with self._changed:
            self._error = self._error or error
            self._changed.notify_all()

    def close(self) -> None:
        """Make the rendering threads end after their current blocks."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
