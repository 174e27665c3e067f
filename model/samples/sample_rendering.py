"""Rendering of samples, singly or a whole store in parallel processes."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

from model.errors import DatasetError, RenderError
from model.measurements import processors
from model.rendering.renderer import Renderer, open_renderer
from model.samples.sample_store import SPLITS, SampleBatch, SampleStore
from model.samples.sampling import Split, draw_sample
from model.scene.inputs import store_inputs
from model.scene.scene import Scene
from model.scene.value_scale import SCALE_NAMES
from model.scene.volume import Volume


def render_samples(
    renderer: Renderer, scene: Scene, seed: int, split: Split, indices: range
) -> SampleBatch:
    """Draw and render samples of a split, by a renderer of the scene's volume and lighting."""
    samples = [draw_sample(scene, seed, split, i) for i in indices]
    images = np.stack([renderer.render(inputs, scene.image_size) for inputs in samples])
    return SampleBatch(store_inputs(samples, scene), np.rint(images * 255).astype(np.uint8))


def make_renderer(volume: Volume, scene: Scene, threads: int | None = 1) -> Renderer:
    """Create a scene's renderer; the ray caster has this many threads, or one per processor."""
    check_volume(volume, scene)
    return open_renderer(
        scene.renderer, volume, scene.lighting, scene.light, scene.sample_distance, threads
    )


def check_volume(volume: Volume, scene: Scene) -> None:
    """Raise :class:`DatasetError` unless the volume is the scene's, on its scale."""
    if volume.fingerprint != scene.volume_fingerprint:
        raise DatasetError(
            f"The volume '{volume.name}' is not the one that the scene was made for "
            f"('{scene.volume_name}'); open that volume, or make a new data set."
        )
    if volume.scale != scene.scale:
        raise DatasetError(
            f"The scene lies over {SCALE_NAMES[scene.scale]}, the volume over "
            f"{SCALE_NAMES[volume.scale]}; choose the other scale, or make a new data set."
        )


def render_store(
    store: SampleStore,
    volume: Volume,
    workers: int | None = None,
    on_progress: Callable[[int], None] = lambda count: None,
) -> None:
    """Render a store's missing samples in parallel processes, one per processor by default."""
    tasks = [(s, block) for s in SPLITS for block in store.missing_blocks(s)]
    if not tasks:
        return
    workers = min(workers or processors(), len(tasks))
    with rendering_pool(workers, volume, store.scene) as pool, explained():
        try:
            blocks = [pool.submit(_render_block, store.path, *task) for task in tasks]
            for done in as_completed(blocks):
                on_progress(done.result())
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def rendering_pool(workers: int, volume: Volume, scene: Scene) -> ProcessPoolExecutor:
    """Return processes that each have an :func:`own_renderer`."""
    # "spawn", as torch's and OpenGL's threads do not survive a fork.
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, context, _start_worker, (volume, scene))


@contextmanager
def explained() -> Iterator[None]:
    """Raise a :class:`RenderError` with an explanation if a pool's process ended."""
    try:
        yield
    except BrokenProcessPool as error:
        raise RenderError(
            "A rendering process ended unexpectedly (out of memory?); go on with fewer processes.",
            workers="1",
        ) from error


_given: tuple[Volume, Scene]  # of a rendering process


def _start_worker(volume: Volume, scene: Scene) -> None:
    global _given
    # Each process renders its own blocks; Mesa's threads would compete with them.
    os.environ.setdefault("LP_NUM_THREADS", "1")
    # The parent process handles Ctrl-C and stops the pool.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _given = volume, scene


@cache
def own_renderer() -> Renderer:
    """Return the renderer of a process of the pool."""
    # Not at the process's start, so that errors reach the parent process.
    return make_renderer(*_given)


@cache
def _opened(path: Path) -> SampleStore:
    return SampleStore(path)


def _render_block(path: Path, split: Split, block: range) -> int:
    store = _opened(path)
    batch = render_samples(own_renderer(), store.scene, store.seed, split, block)
    store.write_block(split, block, batch)
    return len(batch)
