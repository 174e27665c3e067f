import threading

import pytest
from window_fakes import PATIENCE_S, FakeEngine, RefiningEngine, make_request

from app.engines.client import Channel, EngineClient, EngineState
from app.engines.requests import IMAGES, VisibilityRequest
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


def test_an_image_is_waited_for_and_settles(qtbot, told):
    with qtbot.waitSignal(told.client.engineReady):
        told.client.start(FakeEngine, "Loading …")
    assert told.client.text == "Loading …"
    with qtbot.waitSignal(told.client.settled):
        told.client.submit(make_request(3))
    assert told.states == [EngineState.LOADING, EngineState.WORKING, EngineState.SETTLED]
    value = told.results[0].value
    assert value is not None
    assert value.dtype == "float32"
    assert value.shape == (8, 8, 4)
    assert told.results[0].request == make_request(3)


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


def test_it_settles_with_the_last_of_ever_better_images(qtbot, told):
    told.client.start(lambda: RefiningEngine([3, 6, 9]), "Loading …")
    with qtbot.waitSignal(told.client.settled):
        told.client.images.ask(make_request(1))
        assert told.client.images.is_pending
    assert told.states == [EngineState.LOADING, EngineState.WORKING, EngineState.SETTLED]
    assert [result.value.shape[1] for result in told.results if result.value is not None] == [
        3,
        6,
        9,
    ]
    assert not told.client.images.is_pending


def test_errors_are_a_state_with_its_sentence_until_the_next_image(qtbot, told):
    engine = FakeEngine()
    engine.error = RenderError("The memory is full.")
    told.client.start(lambda: engine, "Loading …")
    with qtbot.waitSignal(told.client.settled):
        told.client.submit(make_request(1))
    assert told.client.error == "The memory is full."
    engine.error = None
    with qtbot.waitSignal(told.client.settled):
        told.client.submit(make_request(2))
    assert told.client.error is None
    assert told.states[-3:] == [EngineState.FAILED, EngineState.WORKING, EngineState.SETTLED]


def test_an_engine_that_cannot_be_built_fails(qtbot, told):
    def fail():
        raise CheckpointError("model: the folder is missing.")

    with qtbot.waitSignal(told.client.settled):
        told.client.start(fail, "Loading …")
    assert told.states == [EngineState.LOADING, EngineState.FAILED]
    told.client.submit(make_request(1))
    assert told.client.error == "model: the folder is missing."


def test_requests_wait_until_it_is_known_whether_the_engine_fits(qtbot, told):
    engine = FakeEngine()
    told.client.engineReady.connect(lambda _ready: told.client.pause("Not for this volume."))
    told.client.start(lambda: engine, "Loading …")
    with qtbot.waitSignal(told.client.settled):
        told.client.submit(make_request(1))
    assert told.client.is_settled and not engine.requests
    told.client.resume()
    with qtbot.waitSignal(told.client.images.answered):
        told.client.submit(make_request(2))
    assert [r.sequence for r in engine.requests] == [2]


def test_an_older_images_error_says_nothing_about_the_newest(qtbot, told):
    gate = threading.Semaphore(0)
    engine = FakeEngine(gate=gate)
    with qtbot.waitSignal(told.client.engineReady):
        told.client.start(lambda: engine, "Loading …")
    engine.error = RenderError("Too coarse.")
    told.client.submit(make_request(1, live=True))
    assert engine.started.acquire(timeout=PATIENCE_S)
    told.client.submit(make_request(2))
    gate.release()
    assert engine.started.acquire(timeout=PATIENCE_S)
    engine.error = None
    with qtbot.waitSignal(told.client.settled):
        gate.release()
    assert EngineState.FAILED not in told.states
