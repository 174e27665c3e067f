import threading
from dataclasses import replace

import numpy as np
import pytest
from rested_window import act_until
from window_fakes import PATIENCE_S, FakeEngine, RefiningEngine, make_request

from app.engines import requests
from app.engines.client import Channel, EngineClient, EngineState
from app.engines.messages import Result
from app.engines.worker import EngineWorker
from model.errors import CheckpointError, RenderError
from model.scene.region import Region


class Harness:
    def __init__(self, qtbot, engine):
        self.engine = engine
        self.results = []
        self.receivers = []
        self.worker = EngineWorker(self._build, "test")
        self.worker.told.connect(self._receive)
        act_until(qtbot, self.worker.told, self.worker.start)

    def _build(self):
        self.engine.threads = [threading.current_thread()]
        return self.engine

    def _receive(self, message):
        if isinstance(message, Result):
            self.results.append(message)
            self.receivers.append(threading.current_thread())

    def wait_started(self):
        assert self.engine.started.acquire(timeout=PATIENCE_S)

    def begin(self, live=False):
        """Have the first image drawn."""
        self.worker.mailbox.put(make_request(1, live))
        self.wait_started()

    def end(self, qtbot):
        act_until(qtbot, self.worker.told, self.worker.mailbox.close)
        self.worker.join()


def test_a_stale_result_is_dropped(qtbot):
    harness = Harness(qtbot, FakeEngine())
    for sequence, live in ((5, False), (3, True), (6, False)):
        with qtbot.waitSignal(harness.worker._message):
            harness.worker.mailbox.put(make_request(sequence, live))
    qtbot.waitUntil(lambda: len(harness.results) == 2)
    assert [(r.request.sequence, r.request.quality.live) for r in harness.results] == [
        (5, False),
        (6, False),
    ]
    engine = harness.engine
    assert [r.sequence for r in engine.requests] == [5, 3, 6]
    harness.end(qtbot)
    # The engine lives in one thread, and results arrive in ours.
    assert engine.closed and len(engine.threads) == 5 and len(set(engine.threads)) == 1
    assert threading.current_thread() not in engine.threads
    assert harness.receivers == [threading.current_thread()] * 2


def test_engines_of_settings_are_closed_after_what_waits(qtbot):
    gate, engines = threading.Semaphore(0), []

    def build(settings=None):
        engines.append(FakeEngine(gate=gate))
        return engines[-1]

    worker = EngineWorker(build, "test")
    act_until(qtbot, worker.told, worker.start)
    settings = requests.ReferenceSettings()
    of_b = replace(make_request(1), settings=settings, channel=requests.IMAGES_B)

    def ask_of_b(count):
        worker.mailbox.put(of_b)
        qtbot.waitUntil(lambda: sum(len(each.requests) for each in engines[1:]) == count)

    ask_of_b(1)
    # One that is asked again meanwhile stays.
    worker.mailbox.wake()
    gate.release()
    ask_of_b(2)
    gate.release()
    ask_of_b(3)
    assert len(engines) == 2
    worker.mailbox.put(make_request(2))
    worker.mailbox.wake()
    gate.release(2)
    qtbot.waitUntil(lambda: engines[1].closed)
    assert engines[0].requests and not engines[0].closed
    act_until(qtbot, worker.told, worker.mailbox.close)
    worker.join()


def test_stopping_while_the_engine_is_built_closes_it(qtbot):
    may_load = threading.Event()
    engines = []

    def build():
        assert may_load.wait(PATIENCE_S)
        engines.append(FakeEngine())
        return engines[0]

    worker = EngineWorker(build, "test")
    ready = []
    worker.told.connect(ready.append)
    worker.start()
    worker.mailbox.put(make_request(1))
    worker.mailbox.close()
    act_until(qtbot, worker.told, may_load.set)
    worker.join()
    assert ready == [None]
    assert engines[0].closed
    assert engines[0].requests == []


def visibility(sequence):
    image = make_request(sequence)
    return requests.VisibilityRequest(
        image.inputs, image.quality, (Region(0, 0, 2, 2),), sequence=sequence, channel="visibility"
    )


def test_each_channel_has_a_slot_of_its_own_and_its_turn(qtbot):
    gate = threading.Semaphore(0)
    harness = Harness(qtbot, FakeEngine(gate=gate))
    harness.begin()
    harness.worker.mailbox.put(visibility(2))
    harness.worker.mailbox.put(make_request(3))
    harness.worker.mailbox.put(visibility(4))
    harness.worker.mailbox.put(make_request(5))
    with qtbot.waitSignals([harness.worker.told] * 3):
        gate.release(2)
    found = [(r.request.channel, r.request.sequence) for r in harness.results]
    # The visibility came first of the two that waited, and only the newest of each was left.
    assert found == [("images", 1), ("visibility", 4), ("images", 5)]
    value = harness.results[1].value
    assert value.shape == (1, 256)
    harness.end(qtbot)


def widths_of(harness):
    """Numbers of the requests, and widths of their images, in the order that they came."""
    images = [r for r in harness.results if r.request.channel == "images" and r.value is not None]
    return [(r.request.sequence, r.value.shape[1]) for r in images if r.value is not None]


def test_images_become_better_until_there_is_a_newer_request(qtbot):
    gate = threading.Semaphore(0)
    harness = Harness(qtbot, RefiningEngine([3, 6, 9], gate))
    harness.worker.mailbox.put(make_request(1))
    gate.release()
    qtbot.waitUntil(lambda: widths_of(harness) == [(1, 3)])
    harness.wait_started()
    harness.wait_started()
    # The second one is being drawn.
    harness.worker.mailbox.put(make_request(2))
    gate.release(10)
    qtbot.waitUntil(lambda: len(harness.results) == 5)
    assert widths_of(harness) == [(1, 3), (1, 6), (2, 3), (2, 6), (2, 9)]
    assert [r.is_last for r in harness.results] == [False] * 4 + [True]
    harness.end(qtbot)


@pytest.mark.parametrize(("is_called_off", "order"), [(False, [1, 2, 1, 1]), (True, [1, 2])])
def test_others_have_their_turn_while_images_become_better(qtbot, is_called_off, order):
    gate = threading.Semaphore(0)
    harness = Harness(qtbot, RefiningEngine([3, 6, 9], gate))
    harness.begin()
    if is_called_off:
        harness.worker.mailbox.abandon("images")
    harness.worker.mailbox.put(visibility(2))
    gate.release(10)
    qtbot.waitUntil(lambda: [r.request.sequence for r in harness.results] == order)
    harness.end(qtbot)
    assert [r.request.sequence for r in harness.results] == order


class Endless(FakeEngine):
    """Draws its first image for as long as it is wanted."""

    def image(self, request, watch=requests.UNWATCHED):
        super().image(request)
        while request.sequence == 1 and watch.is_wanted():
            threading.Event().wait(0.001)
        if request.sequence == 1:
            raise requests.SupersededError
        return np.zeros((8, 8, 4), np.float32)


class Patient(FakeEngine):
    """Draws its first image once it has let another request come first."""

    def images_of(self, request, watch=requests.UNWATCHED):
        while not watch.gives_way():
            threading.Event().wait(0.001)
        yield None
        yield from super().images_of(request, watch)


def test_an_image_that_takes_long_makes_way_for_other_channels(qtbot):
    harness = Harness(qtbot, Patient())
    harness.worker.mailbox.put(make_request(1))
    harness.worker.mailbox.put(visibility(2))
    qtbot.waitUntil(lambda: [r.request.sequence for r in harness.results] == [2, 1])
    harness.end(qtbot)


@pytest.mark.parametrize("end", ["newer", "newer than a live one", "called off", "closed"])
def test_what_is_replaced_or_called_off_or_of_a_closed_window_is_given_up(qtbot, end):
    harness = Harness(qtbot, Endless())
    harness.begin(live=end == "newer than a live one")
    if end == "called off":
        harness.worker.mailbox.abandon("images")
    if end != "closed":
        harness.worker.mailbox.put(make_request(2))
        qtbot.waitUntil(lambda: bool(harness.results))
    harness.end(qtbot)
    assert [r.request.sequence for r in harness.results] == ([] if end == "closed" else [2])


class Spy:
    """A client, the states that it went through, and its results."""

    def __init__(self):
        self.client = EngineClient("test")
        self.states = []
        self.results = []
        self.client.stateChanged.connect(self.states.append)
        names = "visibility", "other"
        self.seen, self.other = (Channel(self.client, name, self.client) for name in names)
        for channel in (self.client.images, self.seen, self.other):
            channel.answered.connect(self.results.append)


@pytest.fixture
def spy(qtbot):
    spy = Spy()
    yield spy
    spy.client.stop()
    spy.client.join()


@pytest.fixture
def gated(qtbot, spy):
    """The spied client's engine, which waits in each image."""
    engine = FakeEngine(gate=threading.Semaphore(0))
    act_until(qtbot, spy.client.engineReady, spy.client.start, lambda: engine, "Loading …")
    yield engine
    engine.gate.release(10)


def ask(channel):
    image = make_request(0)
    return channel.ask(requests.ImageRequest(image.inputs, image.quality))


def test_an_engine_draws_before_it_answers(qtbot, spy):
    may_load = threading.Event()

    def build():
        assert may_load.wait(PATIENCE_S)
        return FakeEngine()

    spy.client.start(build, "Loading …")
    of = make_request(1)
    question = requests.VisibilityRequest(of.inputs, of.quality, (Region(0, 0, 4, 4),))
    spy.seen.ask(question)
    spy.client.submit(make_request(2))
    assert spy.states == [EngineState.LOADING]
    with qtbot.waitSignals([spy.client.images.answered, spy.seen.answered]):
        may_load.set()
    assert [result.request.channel for result in spy.results] == [requests.IMAGES, "visibility"]


def test_ever_better_images_are_awaited_until_the_last(qtbot, spy):
    spy.client.start(lambda: RefiningEngine([3, 6, 9]), "Loading …")
    pending = []
    spy.client.images.answered.connect(lambda _: pending.append(spy.client.images.is_pending))
    act_until(qtbot, spy.client.settled, spy.client.images.ask, make_request(1))
    assert pending == [True, True, False]
    assert spy.states == [EngineState.LOADING, EngineState.WORKING, EngineState.SETTLED]


@pytest.mark.parametrize(("error", "sentence"), [
    (RenderError("The memory is full."), "The memory is full."),
    (ValueError("odd shape"), "Unexpected ValueError: odd shape"),
])  # fmt: skip
def test_errors_are_a_state_with_its_sentence_until_the_next_image(qtbot, spy, error, sentence):
    engine = FakeEngine()
    engine.error = error
    spy.client.start(lambda: engine, "Loading …")
    act_until(qtbot, spy.client.settled, spy.client.submit, make_request(1))
    assert (spy.client.text, spy.results) == (sentence, [])
    engine.error = None
    act_until(qtbot, spy.client.settled, spy.client.submit, make_request(2))
    (good,) = spy.results
    assert spy.client.state is not EngineState.FAILED and good.error is None
    assert good.value[0, 0, 0] == pytest.approx(2 / 255)
    assert spy.states[-3:] == [EngineState.FAILED, EngineState.WORKING, EngineState.SETTLED]

    def fail():
        raise CheckpointError("model: the folder is missing.")

    act_until(qtbot, spy.client.settled, spy.client.start, fail, "Loading …")
    spy.client.submit(make_request(3))
    assert spy.client.text == "model: the folder is missing."


def test_an_older_images_error_says_nothing_about_the_newest(qtbot, spy, gated):
    gated.error = RenderError("Too coarse.")
    spy.client.submit(make_request(1, live=True))
    assert gated.started.acquire(timeout=PATIENCE_S)
    spy.client.submit(make_request(2))
    gated.gate.release()
    assert gated.started.acquire(timeout=PATIENCE_S)
    gated.error = None
    act_until(qtbot, spy.client.settled, gated.gate.release)
    assert EngineState.FAILED not in spy.states


def test_an_answer_goes_to_its_asker_alone(qtbot, spy, gated):
    asked = ask(spy.seen), ask(spy.other)
    assert 0 < asked[0].sequence < asked[1].sequence
    assert spy.seen.is_pending and spy.other.is_pending
    heard = [], []
    for channel, answers in zip((spy.seen, spy.other), heard, strict=True):
        channel.answered.connect(answers.append)
    gated.gate.release(10)
    qtbot.waitUntil(lambda: all(heard))
    assert [[result.request for result in answers] for answers in heard] == [[a] for a in asked]
    assert not spy.seen.is_pending and not spy.other.is_pending
    # The engine's own images are nobody else's.
    assert spy.client.state is EngineState.LOADING


def test_what_is_called_off_or_of_an_engine_that_ended_is_not_answered(qtbot, spy, gated):
    ask(spy.seen)
    assert gated.started.acquire(timeout=PATIENCE_S)
    spy.seen.cancel()
    assert not spy.seen.is_pending
    ask(spy.other)
    gated.gate.release(10)
    qtbot.waitUntil(lambda: bool(spy.results))
    # What is asked from then on is.
    ask(spy.seen)
    qtbot.waitUntil(lambda: len(spy.results) == 2)
    assert [result.request.channel for result in spy.results] == ["other", "visibility"]
    # Once the engine ends, nothing is pending or accepted any more.
    ask(spy.seen)
    spy.client.stop()
    assert not spy.seen.is_pending
    ask(spy.seen)
    assert not spy.seen.is_pending
