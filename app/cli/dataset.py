"""``dataset``: render random samples into a store."""

from __future__ import annotations

from pathlib import Path

from app.cli import options
from app.cli.console import console, counting
from model.dataset import STREAMS, SampleStore
from model.sample_rendering import render_store
from model.scene import Scene

MAX_HOLDOUT = 2000


def make_dataset(
    source: options.VolumeSource,
    out: Path,
    count: int,
    holdout: int | None,
    size: int,
    seed: int,
    lighting: options.LightingOption,
    window: str | None,
    workers: int | None,
) -> None:
    """Create a store, or go on with the one that is there, until it holds `count` samples."""
    volume = source.read()
    scene = Scene.of(volume, size, options.lighting(lighting), options.parse_window(window))
    holdout = holdout or max(1, min(count // 10, MAX_HOLDOUT))
    store = SampleStore.create(out, scene, seed, {"train": count, "holdout": holdout})
    total = sum(store.count(stream) for stream in STREAMS)
    missing = store.missing_samples()
    with counting("rendering", total, total - missing) as (progress, task):
        render_store(store, volume, workers, lambda new: progress.advance(task, new))
    console.print(
        f"{out}: {store.count('train')} training and {store.count('holdout')} hold-out samples "
        f"of '{volume.name}', {size} x {size}, {scene.lighting} lighting, seed {seed}."
    )
