"""What a worker of a cluster does: it renders one block and returns the samples."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Any

from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sample_store import SampleBatch
from model.samples.sampling import Split
from model.scene.scene import Scene
from model.scene.volume import Volume


class _Kept(threading.local):
    """What a worker's thread keeps between blocks: an OpenGL context belongs to its thread."""

    made_for: tuple[Scene, str] | None = None
    renderer: Any = None


_kept = _Kept()


def render_block(
    data: tuple[Any, ...],
    fingerprint: str,
    scene_json: dict[str, Any],
    seed: int,
    split: Split,
    block: range,
) -> SampleBatch:
    """Render one block in a thread of a worker.

    Parameters
    ----------
    data : tuple
        The fields of the volume, in order.
    fingerprint : str
        The volume's, which tells it from others without a look at its voxels.
    scene_json : dict
        Of :meth:`model.scene.scene.Scene.to_json`.
    seed : int
    split : {"train", "holdout"}
    block : range
    """
    scene = Scene.from_json(scene_json)
    if _kept.made_for != (scene, fingerprint):
        if _kept.renderer is not None:
            _kept.renderer.close()
        _kept.made_for, _kept.renderer = None, None
        # Each thread is one worker: Mesa's own threads would only compete with the others.
        os.environ.setdefault("LP_NUM_THREADS", "1")
        _kept.renderer = make_renderer(Volume(*data), scene)
        _kept.made_for = scene, fingerprint
    return render_samples(_kept.renderer, scene, seed, split, block)


def render_block_by_value() -> Callable[..., SampleBatch]:
    """What workers are sent: it pickles whole, so that tfscope is looked for in the task only.

    A module that is missing then comes back as an error of the task. Dask
    would otherwise fail, and end the worker, before there is a task.
    """

    def render_on_worker(*arguments: Any) -> SampleBatch:
        from model.samples.cluster_worker import render_block

        return render_block(*arguments)

    return render_on_worker
