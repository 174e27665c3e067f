"""Fresh samples: the right ones, in an order that neither speed nor threads can change."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from model.dataset import ARRAYS, BLOCK, SampleStore
from model.errors import RenderError, TrainingError
from model.sample_rendering import make_renderer, render_samples
from model.scene import Scene
from model.training.sources import StoredSource, TrainingBatch
from model.training.stream import FIRST_SAMPLES, STAGE_SAMPLES, StreamSource
from model.volume import Volume


@pytest.fixture(scope="module")
def raycast(scene: Scene) -> Scene:
    return replace(scene, renderer="raycast", image_size=16)


@contextmanager
def stream(volume: Volume, scene: Scene, **options: object) -> Iterator[StreamSource]:
    source = StreamSource(volume, scene, seed=5, **options)  # type: ignore[arg-type]
    try:
        yield source
    finally:
        source.close()


def assert_same(one: TrainingBatch, other: TrainingBatch) -> None:
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one.samples, name), getattr(other.samples, name))
    np.testing.assert_array_equal(one.weights, other.weights)


@pytest.mark.parametrize("stage", [0, 1])
def test_a_streams_samples_are_those_of_the_scene(
    volume: Volume, raycast: Scene, stage: int
) -> None:
    with stream(volume, raycast, threads=2) as source:
        batch = next(source.batches(stage, 16, 3, 0))
    renderer = make_renderer(volume, raycast)
    for i, index in enumerate(batch.ticket):
        number = int(index) + stage * STAGE_SAMPLES
        expected = render_samples(renderer, raycast, 5, "train", range(number, number + 1))
        for name in ARRAYS:
            ours = getattr(batch.samples, name)[i]
            np.testing.assert_array_equal(ours, getattr(expected, name)[0])
    renderer.close()


def test_batches_do_not_depend_on_threads(volume: Volume, raycast: Scene) -> None:
    with (
        stream(volume, raycast, threads=1) as one,
        stream(volume, raycast, threads=3) as other,
    ):
        for a, b in zip(
            islice(one.batches(0, 16, 3, 0), 12), other.batches(0, 16, 3, 0), strict=False
        ):
            assert_same(a, b)


def test_a_stream_goes_on_where_it_stopped(volume: Volume, raycast: Scene) -> None:
    options = {"threads": 1, "reuse": 1.0, "ring_samples": 600}
    with stream(volume, raycast, **options) as source:
        whole = list(islice(source.batches(0, 16, 3, 0), 14))
        rest = list(islice(source.batches(0, 16, 3, 9), 5))
    for a, b in zip(whole[9:], rest, strict=True):
        assert_same(a, b)


def test_samples_are_learned_from_as_often_as_asked(volume: Volume, raycast: Scene) -> None:
    reuse, ring, batches, size = 4.0, 256, 400, 32
    with stream(volume, raycast, threads=1, reuse=reuse, ring_samples=ring) as source:
        tickets = [b.ticket for b in islice(source.batches(0, size, 3, 0), batches)]
    for number, ticket in enumerate(tickets):
        newest = FIRST_SAMPLES + int(number * size / reuse)
        assert ticket.max() < newest
        assert ticket.min() >= newest - ring
        assert len(set(ticket)) == size
    counts = np.bincount(np.concatenate(tickets))
    # Those that came after the start and have left the ring again.
    gone = counts[FIRST_SAMPLES : FIRST_SAMPLES + int(batches * size / reuse) - ring]
    assert gone.mean() == pytest.approx(reuse, rel=0.05)


def test_a_failing_renderer_ends_the_training(
    volume: Volume, raycast: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RenderError("out of paint")

    with stream(volume, raycast, threads=2) as source:
        monkeypatch.setattr("model.training.stream.render_samples", fail)
        with pytest.raises(RenderError, match="out of paint"):
            next(source.batches(0, 16, 3, 0))


def test_closing_ends_the_threads(volume: Volume, raycast: Scene) -> None:
    with stream(volume, raycast, threads=2) as source:
        next(source.batches(0, 16, 3, 0))
        threads = [t for t in threading.enumerate() if t.name == "samples"]
        assert len(threads) == 2
    for thread in threads:
        thread.join(30)
        assert not thread.is_alive()
    assert source.rendering_seconds > 0


def test_the_holdout_is_that_of_a_store(volume: Volume, raycast: Scene, store: SampleStore) -> None:
    with stream(volume, raycast) as source:
        ours = source.holdout(BLOCK)
        again = source.holdout(BLOCK)
    theirs = StoredSource(store).holdout(BLOCK)
    np.testing.assert_array_equal(ours.rgba, again.rgba)
    assert store.seed != source.seed
    assert not np.array_equal(ours.view, theirs.view)
    with stream(volume, raycast) as source:
        source.seed = store.seed
        np.testing.assert_array_equal(source.holdout(BLOCK).view, theirs.view)


def test_samples_with_a_high_error_come_more_often(volume: Volume, raycast: Scene) -> None:
    with stream(volume, raycast, threads=1, reuse=1000.0, error_driven=True) as source:
        counts = np.zeros(FIRST_SAMPLES + BLOCK)
        for batch in islice(source.batches(0, 32, 3, 0), 600):
            odd = batch.ticket % 2 == 1
            source.report(batch.ticket, np.where(odd, 3.0, 1.0).astype(np.float32))
            np.add.at(counts, batch.ticket, 1)
    # Half of the draws are uniform, the other half in proportion to the error.
    expected = (0.5 + 0.5 * 3 / 2) / (0.5 + 0.5 * 1 / 2)
    late = counts[:FIRST_SAMPLES]
    assert late[1::2].sum() / late[0::2].sum() == pytest.approx(expected, rel=0.1)


def test_paired_samples_stand_next_to_each_other(volume: Volume, raycast: Scene) -> None:
    with stream(volume, raycast, paired=True, threads=2) as source:
        batches = list(islice(source.batches(1, 16, 3, 0), 20))
    with stream(volume, raycast, paired=True, threads=1) as source:
        assert_same(next(source.batches(1, 16, 3, 7)), batches[7])
    for batch in batches:
        assert (batch.ticket[::2] % 2 == 0).all()
        np.testing.assert_array_equal(batch.ticket[1::2], batch.ticket[::2] + 1)
        view = batch.samples.view
        np.testing.assert_array_equal(view[1::2], view[::2])
        edits = np.abs(np.diff(batch.samples.opacity_tf, axis=0)[::2]).max(axis=1)
        assert (edits <= 0.2 + 1e-6).all() and edits.max() > 0.02


def test_pairs_are_not_drawn_by_their_errors(volume: Volume, raycast: Scene) -> None:
    with pytest.raises(TrainingError, match="leave --error-driven out"):
        StreamSource(volume, raycast, 5, error_driven=True, paired=True)
