"""``dataset``: rendering of random samples into a store."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from app.cli import options
from app.cli.options import option
from model.errors import DatasetError, TfscopeError, require
from model.files import free_space
from model.scene.scene import Lighting, Scene, TFFamily
from model.scene.transfer_function import Range
from model.volume_files.source import VolumeSource

MAX_HOLDOUT = 2000


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """Render random samples into a store; run it again to go on or to add more."""

    out: Path = options.folder(help="Zarr folder.", metavar="STORE")
    count: int = option(
        "Training samples; a store never shrinks.", default=options.REQUIRED, min=1, max=10_000_000
    )
    source: VolumeSource = options.volume()
    size: int = options.size()
    seed: int = options.seed()
    lighting: Lighting = options.lighting()
    movable_light: bool = options.movable_light()
    tf_family: TFFamily = option(options.FAMILY_HELP, default="drawn")
    window: Range | None = options.window()
    up: str = options.up()
    holdout: int | None = option("Hold-out samples. (default: a tenth, at most 2000)", min=1)
    workers: int | None = options.workers()
    scheduler: str | None = option(
        "Render on the workers of a Dask scheduler such as tcp://host:8786. (default: processes of "
        "its own)",
        metavar="ADDRESS",
    )

    def run(self) -> None:
        """Create or continue a store until it holds the training samples and its hold-out."""
        if self.workers and self.scheduler is not None:
            raise TfscopeError(
                "--workers is for processes of this machine, and 'dask worker' starts those of a "
                "scheduler; give --workers or --scheduler, not both."
            )
        if self.scheduler is not None:
            require("cluster")
        volume = self.source.read()
        choices = self.movable_light, self.tf_family, self.up
        scene = Scene.of(volume, self.size, self.lighting, self.window, "raycast", *choices)
        # Imported late, so that impossible options are refused at once.
        from app.cli.console import about, render_missing
        from app.cli.outputs import make_room_for
        from model.samples.sample_rendering import render_store
        from model.samples.sample_store import SampleStore
        from model.training.sources import LEAST_HOLDOUT

        out = self.out
        holdout = self.holdout or max(LEAST_HOLDOUT, min(self.count // 10, MAX_HOLDOUT))
        _check_room(out, (self.count + holdout - _rendered(out)) * 4 * self.size**2)
        make_room_for(out)
        store = SampleStore.create(out, scene, self.seed, {"train": self.count, "holdout": holdout})
        damaged = store.reopen_damaged()
        if damaged:
            print(f"{out}: {damaged} samples are lost or altered; they are rendered again.")
        render: Callable[[Callable[[int], None]], None]
        render = partial(render_store, store, volume, self.workers)
        if self.scheduler is not None:
            # Late: with it comes Dask.
            from model.samples.cluster import render_store_on_cluster

            render = partial(render_store_on_cluster, store, volume, self.scheduler)
        start, before = time.monotonic(), store.rendered_samples()
        try:
            render_missing(store, render)
        except KeyboardInterrupt:
            print(f"Stopped; rendered samples stay in {out}. Run the same command to go on.")
            raise
        new = store.rendered_samples() - before
        took = f" Rendering {new:,} of them took {about(time.monotonic() - start)}." if new else ""
        print(
            f"{out}: {store.count('train')} training and {store.count('holdout')} hold-out samples "
            f"of '{volume.name}', {self.size} x {self.size}, {scene.lighting} lighting, "
            f"seed {self.seed}.{took}"
        )


def _rendered(out: Path) -> int:
    """Number of existing samples, which need no more room."""
    from model.samples.sample_store import SampleStore

    try:
        return SampleStore(out).rendered_samples()
    except DatasetError:
        return 0


def _check_room(out: Path, image_bytes: int) -> None:
    """Check the free disk space, assuming that compression is at most tenfold."""
    from rich.filesize import decimal

    free = free_space(out)
    if image_bytes / 10 > free:
        raise TfscopeError(
            f"{out}: these samples take at least {decimal(image_bytes // 10)}, and "
            f"{decimal(free)} are free; lower --count or --size, or choose another place."
        )
