"""A worker's requests: the newest wins, and what nobody waits for is given up."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from ramp import make_volume
from window_fakes import PATIENCE_S, FakeEngine, RefiningEngine, make_request

from app.engines.drawer import Drawer
from app.engines.renderer_engine import RendererEngine
from app.engines.requests import (
    BatchRequest,
    ImageRequest,
    PictureRequest,
    Quality,
    VisibilityRequest,
)
from app.engines.worker import EngineWorker
from model.errors import RenderError
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.region import Region
from model.scene.scene import LightDirection


class Harness:
    """A running worker, its engine and everything it reported."""

    def __init__(self, qtbot, engine):
        self.engine = engine
        self.results = []
        self.receivers = []
        self.worker = EngineWorker(self._build, "test")
        self.worker.resultReady.connect(self._receive)
        with qtbot.waitSignal(self.worker.engineReady):
            self.worker.start()

    def _build(self):
        self.engine.threads = [threading.current_thread()]
        return self.engine

    def _receive(self, result):
        self.results.append(result)
        self.receivers.append(threading.current_thread())

    def end(self, qtbot):
        with qtbot.waitSignal(self.worker.finished):
            self.worker.stop()
        self.worker.join()


def wait_started(engine):
    assert engine.started.acquire(timeout=PATIENCE_S)


def test_the_newest_request_wins(qtbot):
    gate = threading.Semaphore(0)
    harness = Harness(qtbot, FakeEngine(gate=gate))
    harness.worker.submit(make_request(1))
    wait_started(harness.engine)
    for sequence in (2, 3, 4):
        harness.worker.submit(make_request(sequence))
    with qtbot.waitSignals([harness.worker.resultReady] * 2):
        gate.release(2)
    assert [r.request.sequence for r in harness.results] == [1, 4]
    assert [r.sequence for r in harness.engine.requests] == [1, 4]
    harness.end(qtbot)


def test_a_stale_result_is_dropped(qtbot):
    harness = Harness(qtbot, FakeEngine())
    for sequence, live in ((5, False), (3, True), (6, False)):
        with qtbot.waitSignal(harness.worker._message):
            harness.worker.submit(make_request(sequence, live))
    qtbot.waitUntil(lambda: len(harness.results) == 2)
    assert [(r.request.sequence, r.request.quality.live) for r in harness.results] == [
        (5, False),
        (6, False),
    ]
    assert [r.sequence for r in harness.engine.requests] == [5, 3, 6]
    harness.end(qtbot)


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (RenderError("VTK finds no OpenGL."), "VTK finds no OpenGL."),
        (ValueError("odd shape"), "Unexpected ValueError: odd shape"),
    ],
)
def test_an_error_is_data_and_the_worker_goes_on(qtbot, error, sentence):
    harness = Harness(qtbot, FakeEngine())
    harness.engine.error = error
    with qtbot.waitSignal(harness.worker.resultReady):
        harness.worker.submit(make_request(1))
    harness.engine.error = None
    with qtbot.waitSignal(harness.worker.resultReady):
        harness.worker.submit(make_request(2))
    failed, good = harness.results
    assert failed.error == sentence
    assert failed.value is None
    assert good.error is None
    assert good.value is not None
    assert good.value[0, 0, 0] == pytest.approx(2 / 255)
    harness.end(qtbot)


def test_the_engine_lives_in_one_thread_and_results_arrive_in_ours(qtbot):
    harness = Harness(qtbot, FakeEngine())
    with qtbot.waitSignal(harness.worker.resultReady):
        harness.worker.submit(make_request(1))
    harness.end(qtbot)
    engine = harness.engine
    assert engine.closed
    assert len(engine.threads) == 3
    assert len(set(engine.threads)) == 1
    assert engine.threads[0] is not threading.current_thread()
    assert harness.receivers == [threading.current_thread()]


def test_stopping_while_the_engine_is_built_closes_it(qtbot):
    may_load = threading.Event()
    engines = []

    def build():
        assert may_load.wait(PATIENCE_S)
        engines.append(FakeEngine())
        return engines[0]

    worker = EngineWorker(build, "test")
    ready = []
    worker.engineReady.connect(ready.append)
    worker.start()
    worker.submit(make_request(1))
    worker.stop()
    with qtbot.waitSignal(worker.finished):
        may_load.set()
    worker.join()
    assert ready == []
    assert engines[0].closed
    assert engines[0].requests == []


def visibility(sequence):
    image = make_request(sequence)
    return VisibilityRequest(
        image.inputs, image.quality, (Region(0, 0, 2, 2),), sequence=sequence, channel="visibility"
    )


def test_each_channel_has_a_slot_of_its_own_and_its_turn(qtbot):
    gate = threading.Semaphore(0)
    harness = Harness(qtbot, FakeEngine(gate=gate))
    harness.worker.submit(make_request(1))
    wait_started(harness.engine)
    harness.worker.submit(visibility(2))
    harness.worker.submit(make_request(3))
    harness.worker.submit(visibility(4))
    harness.worker.submit(make_request(5))
    with qtbot.waitSignals([harness.worker.resultReady] * 3):
        gate.release(2)
    found = [(r.request.channel, r.request.sequence) for r in harness.results]
    # The visibility came first of the two that waited, and only the newest of each was left.
    assert found == [("images", 1), ("visibility", 4), ("images", 5)]
    value = harness.results[1].value
    assert value is not None
    assert value.shape == (1, 256)
    harness.end(qtbot)


def widths_of(harness):
    """Numbers of the requests, and widths of their images, in the order that they came."""
    images = [r for r in harness.results if r.request.channel == "images" and r.value is not None]
    return [(r.request.sequence, r.value.shape[1]) for r in images if r.value is not None]


def test_images_become_better_until_there_is_a_newer_request(qtbot):
    gate = threading.Semaphore(0)
    harness = Harness(qtbot, RefiningEngine([3, 6, 9], gate))
    harness.worker.submit(make_request(1))
    gate.release()
    qtbot.waitUntil(lambda: widths_of(harness) == [(1, 3)])
    wait_started(harness.engine)
    wait_started(harness.engine)
    # The second one is being drawn.
    harness.worker.submit(make_request(2))
    gate.release(10)
    qtbot.waitUntil(lambda: len(harness.results) == 5)
    assert widths_of(harness) == [(1, 3), (1, 6), (2, 3), (2, 6), (2, 9)]
    assert [r.is_last for r in harness.results] == [False] * 4 + [True]
    harness.end(qtbot)


def test_nothing_better_follows_what_is_called_off(qtbot):
    gate = threading.Semaphore(0)
    harness = Harness(qtbot, RefiningEngine([3, 6, 9], gate))
    harness.worker.submit(make_request(1))
    wait_started(harness.engine)
    harness.worker.abandon("images")
    gate.release(10)
    harness.worker.submit(visibility(2))
    qtbot.waitUntil(lambda: bool(harness.results) and harness.results[-1].request.sequence == 2)
    assert widths_of(harness) == [(1, 3)]
    harness.end(qtbot)


def test_others_have_their_turn_while_images_become_better(qtbot):
    gate = threading.Semaphore(0)
    harness = Harness(qtbot, RefiningEngine([3, 6, 9], gate))
    harness.worker.submit(make_request(1))
    wait_started(harness.engine)
    harness.worker.submit(visibility(2))
    gate.release(10)
    qtbot.waitUntil(lambda: len(harness.results) == 4)
    assert [r.request.sequence for r in harness.results] == [1, 2, 1, 1]
    harness.end(qtbot)


INPUTS = replace(make_request(1).inputs, light=LightDirection())


CHANNEL = "slow"

QUESTIONS = {
    "batch": BatchRequest(INPUTS, Quality(8), (INPUTS,) * 15),
    "image": ImageRequest(INPUTS, Quality(2000)),
    "picture": PictureRequest(INPUTS, Quality(2500)),
}
"""Questions that take more than one rendering."""


class SlowRenderer(RaycastRenderer):
    """A ray caster in soft light, each of whose renderings has to be let through."""

    def __init__(self):
        super().__init__(make_volume(), "soft", LightDirection(), threads=1)
        self.begun, self.may_end = threading.Semaphore(0), threading.Semaphore(0)
        self.renderings = 0

    def render(self, inputs, size=0, *_, go_on=lambda: None):
        self.renderings += 1
        self.begun.release()
        assert self.may_end.acquire(timeout=PATIENCE_S)
        go_on()
        return np.ones((*Raster.of(size).shape, 4), np.float32)


class SlowWorker:
    """A worker with a slow renderer, and the results that it delivers."""

    def __init__(self):
        self.renderer, self.results = SlowRenderer(), []
        engine = RendererEngine(Drawer(self.renderer, 1.0))
        self.worker = EngineWorker(lambda: engine, "slow")
        self.worker.resultReady.connect(self.results.append)
        self.worker.start()

    def begin(self, request):
        """Ask, and wait for the first rendering to begin."""
        self.worker.submit(request)
        assert self.renderer.begun.acquire(timeout=PATIENCE_S)


@pytest.fixture
def slow(qapp):
    harness = SlowWorker()
    yield harness
    harness.worker.stop()
    harness.renderer.may_end.release(10_000)
    harness.worker.join()


@pytest.fixture(params=QUESTIONS)
def question(request):
    return replace(QUESTIONS[request.param], sequence=1, channel=CHANNEL)


@pytest.mark.parametrize("is_newer", [True, False])
def test_what_is_called_off_or_replaced_ends_with_the_present_rendering(
    qtbot, slow, question, is_newer
):
    slow.begin(question)
    if not is_newer:
        slow.worker.abandon(CHANNEL)
    slow.worker.submit(replace(question, sequence=2) if is_newer else make_request(2))
    slow.renderer.may_end.release()
    assert slow.renderer.begun.acquire(timeout=PATIENCE_S)
    assert slow.renderer.renderings == 2
    slow.renderer.may_end.release(10_000)
    qtbot.waitUntil(lambda: len(slow.results) == 1)
    assert slow.results[0].request.sequence == 2


def test_as_the_window_closes_it_ends_with_the_present_rendering(qtbot, slow, question):
    slow.begin(question)
    with qtbot.waitSignal(slow.worker.finished):
        slow.worker.stop()
        slow.renderer.may_end.release()
    slow.worker.join()
    assert slow.renderer.renderings == 1 and slow.results == []
