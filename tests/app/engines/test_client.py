import threading

import numpy as np
import pytest
from rested_window import act_until
from window_fakes import PATIENCE_S, FakeEngine, RefiningEngine, make_request

from app.engines import worker
from app.engines.client import Channel, EngineClient, EngineState
from app.engines.requests import IMAGES, ImageRequest, VisibilityRequest
from model.errors import CheckpointError, RenderError
from model.scene.region import Region


class Told:
    """A client, the states that it went through, and its results."""

    def __init__(self):
        self.client = EngineClient("test")
        self.states = []
        self.results = []
        self.client.stateChanged.connect(self.states.append)
        self.seen = Channel(self.client, "visibility", self.client)
        for channel in (self.client.images, self.seen):
            channel.answered.connect(self.results.append)


@pytest.fixture
def told(qtbot):
    told = Told()
    yield told
    told.client.stop()
    told.client.join()


def test_an_engine_draws_before_it_answers(qtbot, told):
    may_load = threading.Event()

    def build():
        assert may_load.wait(PATIENCE_S)
        return FakeEngine()

    told.client.start(build, "Loading …")
    question = VisibilityRequest(
        make_request(1).inputs, make_request(1).quality, (Region(0, 0, 4, 4),)
    )
    told.seen.ask(question)
    told.client.submit(make_request(2))
    assert told.states == [EngineState.LOADING]
    with qtbot.waitSignals([told.client.images.answered, told.seen.answered]):
        may_load.set()
    assert [result.request.channel for result in told.results] == [IMAGES, "visibility"]


def test_ever_better_images_are_awaited_until_the_last(qtbot, told):
    told.client.start(lambda: RefiningEngine([3, 6, 9]), "Loading …")
    pending = []
    told.client.images.answered.connect(lambda _: pending.append(told.client.images.is_pending))
    act_until(qtbot, told.client.settled, told.client.images.ask, make_request(1))
    assert pending == [True, True, False]
    assert told.states == [EngineState.LOADING, EngineState.WORKING, EngineState.SETTLED]


def test_errors_are_a_state_with_its_sentence_until_the_next_image(qtbot, told):
    engine = FakeEngine()
    engine.error = RenderError("The memory is full.")
    told.client.start(lambda: engine, "Loading …")
    act_until(qtbot, told.client.settled, told.client.submit, make_request(1))
    assert told.client.error == "The memory is full."
    engine.error = None
    act_until(qtbot, told.client.settled, told.client.submit, make_request(2))
    assert told.client.error is None
    assert told.states[-3:] == [EngineState.FAILED, EngineState.WORKING, EngineState.SETTLED]


def test_an_engine_that_cannot_be_built_fails(qtbot, told):
    def fail():
        raise CheckpointError("model: the folder is missing.")

    act_until(qtbot, told.client.settled, told.client.start, fail, "Loading …")
    assert told.states == [EngineState.LOADING, EngineState.FAILED]
    told.client.submit(make_request(1))
    assert told.client.error == "model: the folder is missing."


def test_an_older_images_error_says_nothing_about_the_newest(qtbot, told):
    gate = threading.Semaphore(0)
    engine = FakeEngine(gate=gate)
    act_until(qtbot, told.client.engineReady, told.client.start, lambda: engine, "Loading …")
    engine.error = RenderError("Too coarse.")
    told.client.submit(make_request(1, live=True))
    assert engine.started.acquire(timeout=PATIENCE_S)
    told.client.submit(make_request(2))
    gate.release()
    assert engine.started.acquire(timeout=PATIENCE_S)
    engine.error = None
    act_until(qtbot, told.client.settled, gate.release)
    assert EngineState.FAILED not in told.states


class Asking:
    """A client whose engine waits in each image, two channels to it, and their answers."""

    def __init__(self, qtbot):
        self.client = EngineClient("test")
        self.engine = FakeEngine(gate=threading.Semaphore(0))
        self.one, self.other = (Channel(self.client, name, self.client) for name in ("one", "two"))
        self.heard = {self.one: [], self.other: []}
        for channel, heard in self.heard.items():
            channel.answered.connect(heard.append)
        with qtbot.waitSignal(self.client.engineReady):
            self.client.start(lambda: self.engine, "Loading …")

    def ask(self, channel):
        image = make_request(0)
        return channel.ask(ImageRequest(image.inputs, image.quality))

    def begin(self, channel):
        asked = self.ask(channel)
        assert self.engine.started.acquire(timeout=PATIENCE_S)
        return asked

    def let_draw(self):
        self.engine.gate.release(10)


@pytest.fixture
def asking(qtbot):
    asking = Asking(qtbot)
    yield asking
    asking.let_draw()
    asking.client.stop()
    asking.client.join()


def test_an_answer_goes_to_its_asker_alone(qtbot, asking):
    first, second = asking.ask(asking.one), asking.ask(asking.other)
    assert 0 < first.sequence < second.sequence
    assert asking.one.is_pending and asking.other.is_pending
    asking.let_draw()
    qtbot.waitUntil(lambda: bool(asking.heard[asking.one] and asking.heard[asking.other]))
    assert [result.request for result in asking.heard[asking.one]] == [first]
    assert asking.heard[asking.one][0].request.sequence == first.sequence
    assert [result.request.channel for result in asking.heard[asking.other]] == ["two"]
    assert not asking.one.is_pending and not asking.other.is_pending
    # The engine's own images are nobody else's.
    assert asking.client.state.name == "LOADING"


def test_what_is_called_off_is_not_answered(qtbot, asking):
    asking.begin(asking.one)
    asking.one.cancel()
    assert not asking.one.is_pending
    asking.ask(asking.other)
    asking.let_draw()
    qtbot.waitUntil(lambda: bool(asking.heard[asking.other]))
    assert not asking.heard[asking.one]
    # What is asked from then on is.
    asking.ask(asking.one)
    qtbot.waitUntil(lambda: bool(asking.heard[asking.one]))


def test_how_far_the_newest_answer_has_got_is_heard_by_its_asker(qtbot, asking, monkeypatch):
    monkeypatch.setattr(worker, "PROGRESS_S", 0.0)
    heard = []
    asking.one.progressed.connect(heard.append)
    asking.other.progressed.connect(lambda _part: pytest.fail("It asked for something else."))

    def image(request, watch):
        for part in (0.0, 0.5):
            watch.note(part)
        return np.zeros((8, 8, 4), np.float32)

    asking.engine.image = image
    asking.ask(asking.one)
    qtbot.waitUntil(lambda: bool(asking.heard[asking.one]))
    assert heard == [0.0, 0.5]


def test_nothing_is_pending_any_more_once_the_engine_ends(asking):
    asking.begin(asking.one)
    asking.let_draw()
    asking.client.stop()
    assert not asking.one.is_pending
    # Without an engine nothing is accepted.
    asking.ask(asking.one)
    assert not asking.one.is_pending
