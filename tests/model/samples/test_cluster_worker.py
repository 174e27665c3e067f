from __future__ import annotations

import pickle
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import cloudpickle
import numpy as np
import pytest

from model.errors import DatasetError
from model.samples import cluster_worker
from model.samples.cluster_worker import render_block, render_block_by_value
from model.samples.sample_store import SampleStore
from model.scene.scene import Scene
from model.scene.volume import Volume


@pytest.fixture(autouse=True)
def nothing_kept() -> Iterator[None]:
    yield
    kept = cluster_worker._kept
    if kept.renderer is not None:
        kept.renderer.close()
    kept.made_for = kept.renderer = None


@pytest.fixture
def data(volume: Volume) -> tuple[Any, ...]:
    names = ("voxels", "spacing", "origin", "name")
    return {name: getattr(volume, name) for name in names}, volume.fingerprint


def test_the_renderer_stays_until_the_scene_changes(
    data: tuple[Any, ...], scene: Scene, store: SampleStore
) -> None:
    small = replace(scene, image_size=32)
    renderers = []
    for each, size in ((scene, 64), (scene, 64), (small, 32), (scene, 64)):
        batch = render_block(*data, each.to_json(), 7, "train", range(3, 5))
        assert batch.rgba.shape == (2, size, size, 4)
        renderers.append(cluster_worker._kept.renderer)
        if each is scene:
            np.testing.assert_array_equal(batch.rgba, store.read("train", range(3, 5)).rgba)
    first, second, third, fourth = renderers
    assert first is second
    assert third is not second and fourth is not third


def test_another_volume_gets_no_renderer_of_the_first(data: tuple[Any, ...], scene: Scene) -> None:
    render_block(*data, scene.to_json(), 7, "train", range(1))
    other = Volume(data[0]["voxels"][::-1])
    with pytest.raises(DatasetError, match="is not the one"):
        render_block(
            {"voxels": other.voxels}, other.fingerprint, scene.to_json(), 7, "train", range(1)
        )


def test_each_thread_has_its_own(data: tuple[Any, ...], scene: Scene, store: SampleStore) -> None:
    def in_thread() -> Any:
        batch = render_block(*data, scene.to_json(), 7, "holdout", range(1))
        renderer, cluster_worker._kept.renderer = cluster_worker._kept.renderer, None
        renderer.close()
        return renderer, batch

    here = render_block(*data, scene.to_json(), 7, "holdout", range(1))
    with ThreadPoolExecutor(1) as thread:
        renderer, there = thread.submit(in_thread).result()
    assert renderer is not cluster_worker._kept.renderer
    for batch in (here, there):
        np.testing.assert_array_equal(batch.rgba, store.read("holdout", range(1)).rgba)


def test_what_is_sent_needs_tfscope_only_when_it_is_called(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sent = cloudpickle.dumps(render_block_by_value())
    monkeypatch.setitem(sys.modules, "model.samples.cluster_worker", None)
    task = pickle.loads(sent)
    with pytest.raises(ModuleNotFoundError):
        task()
