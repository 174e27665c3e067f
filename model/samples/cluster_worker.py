"""Rendering of one block of samples by a cluster's worker."""

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
    """Renderer kept between blocks, one per thread, as OpenGL contexts belong to threads."""

    made_for: tuple[Scene, str] | None = None
    renderer: Any = None


_kept = _Kept()


def render_block(
    data: dict[str, Any],
    fingerprint: str,
    scene_json: dict[str, Any],
    seed: int,
    split: Split,
    block: range,
) -> SampleBatch:
    """Render one block in a thread of a worker.

    Parameters
    ----------
    data : dict
        The fields of the volume by name, but for its file's facts and itself on a linear scale.
    fingerprint : str
        The volume's fingerprint, to compare volumes without reading their voxels.
    scene_json : dict
        Result of :meth:`model.scene.scene.Scene.to_json`.
    split : {"train", "holdout"}
    """
    scene = Scene.from_json(scene_json)
    if _kept.made_for != (scene, fingerprint):
        if _kept.renderer is not None:
            _kept.renderer.close()
        _kept.made_for, _kept.renderer = None, None
        # Each thread renders its own blocks; Mesa's threads would compete with them.
        os.environ.setdefault("LP_NUM_THREADS", "1")
        _kept.renderer = make_renderer(Volume(**data), scene)
        _kept.made_for = scene, fingerprint
    return render_samples(_kept.renderer, scene, seed, split, block)


def render_block_by_value() -> Callable[..., SampleBatch]:
    """Return :func:`render_block` as a function that is pickled by value.

    Workers then import tfscope only within the task, so that a missing module is
    reported as the task's error. Otherwise unpickling would fail and end the worker
    before the task begins.
    """

    def render_on_worker(*arguments: Any) -> SampleBatch:
        from model.samples.cluster_worker import render_block

        return render_block(*arguments)

    return render_on_worker
