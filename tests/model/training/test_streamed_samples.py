import multiprocessing
import threading
from contextlib import closing
from dataclasses import replace
from itertools import islice
from unittest import mock

import numpy as np
import pytest

from model.errors import RenderError
from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sample_store import BLOCK
from model.samples.sampling import draw_sample
from model.training.sources import (
    FIRST_SAMPLES,
    PROCESS_RINGS,
    RING_SAMPLES,
    STAGE_SAMPLES,
    StoredSource,
    StreamSource,
)


@pytest.fixture(scope="module")
def raycast(scene):
    return replace(scene, renderer="raycast", image_size=16)


def stream(volume, scene, ring=RING_SAMPLES, seed=5, **options):
    with mock.patch("model.training.sources.RING_SAMPLES", ring):
        return StreamSource(volume, scene, seed=seed, **options)


@pytest.mark.parametrize("stage", [0, 1])
def test_a_streams_samples_are_those_of_the_scene(volume, raycast, stage):
    batch = next(stream(volume, raycast, threads=2).batches(stage, 16, 3, 0))
    renderer = make_renderer(volume, raycast)
    # No two azimuths are the same.
    indices = range(stage * STAGE_SAMPLES, stage * STAGE_SAMPLES + FIRST_SAMPLES)
    numbers = {draw_sample(raycast, 5, "train", i).view.azimuth: i for i in indices}
    for i, azimuth in enumerate(batch.inputs["view"][:, 0].tolist()):
        number = numbers[azimuth]
        expected = render_samples(renderer, raycast, 5, "train", range(number, number + 1))
        for name, values in expected.arrays.items():
            np.testing.assert_array_equal(batch.arrays[name][i], values[0])


@pytest.mark.parametrize(
    ("ring", "by"),
    [
        (RING_SAMPLES, {"threads": 3}),
        pytest.param(
            RING_SAMPLES // PROCESS_RINGS, {"threads": 2, "processes": True}, marks=pytest.mark.slow
        ),
    ],
)
def test_batches_do_not_depend_on_threads_or_processes(volume, raycast, ring, by):
    one, other = stream(volume, raycast, threads=1), stream(volume, raycast, ring, **by)
    batches = (islice(source.batches(1, 16, 3, 0, 16), 8) for source in (one, other))
    for a, b in zip(*batches, strict=True):
        np.testing.assert_equal(a.arrays, b.arrays)


@pytest.mark.slow
def test_a_rendering_process_that_is_gone_is_reported(volume, raycast):
    source = stream(volume, raycast, threads=1, reuse=1.0, processes=True)
    batches = source.batches(0, 16, 3, 0)
    next(batches)
    for process in multiprocessing.active_children():
        process.kill()
    with pytest.raises(RenderError, match="ended unexpectedly"):
        list(islice(batches, 100))


def test_a_stream_goes_on_where_it_stopped(volume, raycast):
    source = stream(volume, raycast, ring=600, threads=1, reuse=1.0)
    whole = list(islice(source.batches(0, 16, 3, 0), 14))
    rest = list(islice(source.batches(0, 16, 3, 9), 5))
    for a, b in zip(whole[9:], rest, strict=True):
        np.testing.assert_equal(a.arrays, b.arrays)


def test_a_failing_renderer_ends_the_training(volume, raycast, monkeypatch):
    fail = mock.Mock(side_effect=RenderError("out of paint"))
    source = stream(volume, raycast, threads=2)
    monkeypatch.setattr("model.training.sources.render_samples", fail)
    with pytest.raises(RenderError, match="out of paint"):
        next(source.batches(0, 16, 3, 0))


def test_closing_ends_the_threads(volume, raycast):
    source = stream(volume, raycast, threads=2)
    with closing(source.batches(0, 16, 3, 0)) as batches:
        next(batches)
        threads = [t for t in threading.enumerate() if t.name == "samples"]
        assert len(threads) == 2
    assert not any(thread.is_alive() for thread in threads)


def test_the_holdout_is_that_of_a_store_of_the_seed(volume, raycast, store):
    views = []
    for seed in (store.seed, 5):
        source = stream(volume, raycast, seed=seed)
        ours, again = (source.first("holdout", BLOCK) for _ in range(2))
        np.testing.assert_array_equal(ours.rgba, again.rgba)
        views.append(ours.inputs["view"])
    theirs = StoredSource(store).first("holdout", BLOCK).inputs["view"]
    np.testing.assert_array_equal(views[0], theirs)
    assert not np.array_equal(views[1], theirs)
