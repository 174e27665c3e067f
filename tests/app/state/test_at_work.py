"""What takes long is told, with how far it is, until it is there or called off."""

import threading

import numpy as np
import pytest
from window_fakes import PATIENCE_S, FakeEngine, make_request

from app.engines import worker
from app.engines.client import Channel, EngineClient
from app.engines.requests import BatchRequest
from app.state import at_work
from app.state.at_work import AtWork


class Slow(FakeEngine):
    """Draws half of several images, and the other when it may."""

    def __init__(self):
        super().__init__()
        self.half, self.may_end = threading.Semaphore(0), threading.Semaphore(0)

    def images(self, request, watch):
        watch.note(0.5)
        self.half.release()
        assert self.may_end.acquire(timeout=PATIENCE_S)
        watch.note(0.75)
        return np.zeros((1, 8, 8, 4), np.float32)


class Asking:
    """Two channels of an asker, and what is told of them."""

    def __init__(self, qtbot):
        self.client, self.engine = EngineClient("test"), Slow()
        self.channels = [Channel(self.client, name, self.client) for name in ("one", "two")]
        self.told = []
        self.work = AtWork(self.channels, self.client)
        self.work.changed.connect(self.told.append)
        with qtbot.waitSignal(self.client.engineReady):
            self.client.start(lambda: self.engine, "Loading …")

    def ask(self, number=0):
        image = make_request(1)
        self.channels[number].ask(BatchRequest(image.inputs, image.quality))


@pytest.fixture
def asking(qtbot, monkeypatch):
    monkeypatch.setattr(worker, "PROGRESS_S", 0.0)
    monkeypatch.setattr(at_work, "PATIENCE_MS", 40)
    asking = Asking(qtbot)
    yield asking
    asking.engine.may_end.release(10)
    asking.client.stop()
    asking.client.join()


def test_what_takes_long_is_told_until_it_is_there(qtbot, asking):
    asking.ask()
    qtbot.waitUntil(lambda: asking.told == [0.0])
    asking.engine.may_end.release()
    qtbot.waitUntil(lambda: asking.told == [0.0, 0.75, None])


def test_what_is_called_off_is_no_longer_told(qtbot, asking):
    asking.ask()
    asking.ask(1)
    qtbot.waitUntil(lambda: asking.told == [0.0])
    asking.channels[0].cancel()
    # The other is still awaited.
    assert asking.told == [0.0]
    asking.client.stop()
    assert asking.told == [0.0, None]
