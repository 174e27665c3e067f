"""Samples for a run that was given none: rendered first, within part of its budget."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from model.dataset import BLOCK, STREAMS, SampleStore
from model.sample_rendering import render_store
from model.scene import Scene
from model.training.options import Budget
from model.volume import Volume

OWN_SAMPLES = "samples.zarr"
"""Name of the store in the run's folder."""

RENDERING_SHARE = 0.25
"""Share of a budget in minutes that rendering may take."""

MAX_SAMPLES, MIN_SAMPLES = 20_000, 4 * BLOCK
HOLDOUT_SAMPLES = 4 * BLOCK
REUSE = 10
"""With a budget in samples, how often each stored sample is seen."""


def render_for_run(
    folder: Path,
    volume: Volume,
    scene: Scene,
    seed: int,
    budget: Budget,
    workers: int | None = None,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[SampleStore, Budget]:
    """Render a run's own samples, or open those that an earlier session rendered.

    Parameters
    ----------
    folder : Path
        Where the store is kept.
    volume : Volume
    scene : Scene
    seed : int
    budget : Budget
        Of the whole run, rendering included.
    workers : int, optional
    on_progress : callable
        Called with the number of samples done and wanted.

    Returns
    -------
    store : SampleStore
        Complete; with a budget in minutes, as many samples as its share of
        the time allowed.
    budget : Budget
        What is left for training.

    Raises
    ------
    DatasetError
        When the folder holds samples of another scene or seed.
    """
    deadline = None
    count = MAX_SAMPLES
    if budget.samples is not None:
        count = min(max(budget.samples // REUSE, MIN_SAMPLES), MAX_SAMPLES)
    else:
        assert budget.minutes is not None
        deadline = time.monotonic() + 60 * budget.minutes * RENDERING_SHARE
        budget = Budget(minutes=budget.minutes * (1 - RENDERING_SHARE))
    store = SampleStore.create(folder, scene, seed, {"holdout": HOLDOUT_SAMPLES})
    if store.count("train") >= MIN_SAMPLES and not store.missing_samples():
        return store, budget
    store = SampleStore.create(folder, scene, seed, {"holdout": HOLDOUT_SAMPLES, "train": count})
    total = sum(store.count(stream) for stream in STREAMS)
    done = total - store.missing_samples()

    def advance(new: int) -> None:
        nonlocal done
        done += new
        on_progress(done, total)

    # The least that training needs is rendered whatever the time; the rest until the deadline.
    render_store(store, volume, workers, advance, until=lambda: _enough(store, done, deadline))
    store.trim()
    return store, budget


def _enough(store: SampleStore, done: int, deadline: float | None) -> bool:
    least = store.count("holdout") + MIN_SAMPLES
    return deadline is not None and done >= least and time.monotonic() > deadline
