"""``dataset``: rendering of random samples into a store."""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

from rich.filesize import decimal

from app.cli.console import about, console, counting
from app.cli.outputs import make_room_for
from model.errors import DatasetError, TfscopeError, require
from model.files import free_space
from model.scene.scene import Lighting, Scene, TFFamily
from model.scene.transfer_function import Range
from model.volume_files.source import VolumeSource

MAX_HOLDOUT = 2000


class SceneOptions(NamedTuple):
    """Arguments of :meth:`model.scene.scene.Scene.of` after the volume."""

    image_size: int
    lighting: Lighting
    scalar_window: Range | None
    movable_light: bool
    tf_family: TFFamily
    up: str


def make_dataset(
    source: VolumeSource,
    options: SceneOptions,
    out: Path,
    count: int,
    holdout: int | None,
    seed: int,
    workers: int | None,
    scheduler: str | None,
) -> None:
    """Create or continue a store until it holds `count` training samples and its hold-out."""
    if workers and scheduler is not None:
        raise TfscopeError(
            "--workers counts processes of this machine, and those of a scheduler are started "
            "with 'dask worker'; leave one of --workers and --scheduler out."
        )
    if scheduler is not None:
        require("cluster")
    volume = source.read()
    scene, size = Scene.of(volume, **options._asdict(), renderer="raycast"), options.image_size
    # Late: impossible options are refused before it.
    from model.samples.sample_rendering import render_store
    from model.samples.sample_store import SampleStore
    from model.training.sources import LEAST_HOLDOUT

    holdout = holdout or max(LEAST_HOLDOUT, min(count // 10, MAX_HOLDOUT))
    _check_room(out, (count + holdout - _rendered(out)) * 4 * size**2)
    make_room_for(out)
    store = SampleStore.create(out, scene, seed, {"train": count, "holdout": holdout})
    damaged = store.reopen_damaged()
    if damaged:
        console.print(f"{out}: {damaged} samples are lost or altered; they are rendered again.")
    rendered = store.rendered_samples()
    total = rendered + store.missing_samples()
    start, new_samples = time.monotonic(), 0

    def advance(new: int) -> None:
        nonlocal new_samples
        new_samples += new
        progress.advance(task, new)

    try:
        with counting("rendering", total, rendered) as (progress, task):
            if scheduler is None:
                render_store(store, volume, workers, advance)
            else:
                # Late: with it comes Dask.
                from model.samples.cluster import render_store_on_cluster

                render_store_on_cluster(store, volume, scheduler, advance)
    except KeyboardInterrupt:
        console.print(f"Stopped; what is rendered stays in {out}. The same command goes on.")
        raise
    finally:
        if new_samples:
            store.add_rendering(time.monotonic() - start, new_samples)
    seconds, timed = store.rendering
    took = f" Rendering {timed:,} of them took {about(seconds)}." if timed else ""
    console.print(
        f"{out}: {store.count('train')} training and {store.count('holdout')} hold-out samples "
        f"of '{volume.name}', {size} x {size}, {scene.lighting} lighting, seed {seed}.{took}"
    )


def _rendered(out: Path) -> int:
    """Number of samples that are there already and need no more room."""
    from model.samples.sample_store import SampleStore

    try:
        return SampleStore(out).rendered_samples()
    except DatasetError:
        return 0


def _check_room(out: Path, image_bytes: int) -> None:
    """Check the free disk space, assuming that compression is at most tenfold."""
    free = free_space(out)
    if image_bytes / 10 > free:
        raise TfscopeError(
            f"{out}: these samples take at least {decimal(image_bytes // 10)}, and "
            f"{decimal(free)} are free; lower --count or --size, or choose another place."
        )
