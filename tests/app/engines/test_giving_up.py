import threading
from dataclasses import replace

import numpy as np
import pytest
from ramp import make_volume
from window_fakes import PATIENCE_S, make_request

from app.engines.drawer import Drawer
from app.engines.renderer_engine import RendererEngine
from app.engines.requests import BatchRequest, ImageRequest, PictureRequest, Quality
from app.engines.worker import EngineWorker
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.light import LightDirection

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
        self.begun = threading.Semaphore(0)
        self.may_end = threading.Semaphore(0)
        self.renderings = 0
        self.error = None

    def change(self, inputs, size, edit):
        return self.render(inputs, size)[..., :3]

    def render(self, inputs, size=0, *_, **__):
        self.renderings += 1
        self.begun.release()
        assert self.may_end.acquire(timeout=PATIENCE_S)
        if self.error is not None:
            raise self.error
        self._go_on()
        rows, columns = (size, size) if isinstance(size, int) else (size.rows, size.columns)
        return np.ones((rows, columns, 4), np.float32)


class Harness:
    """A worker with a slow renderer, and the results that it delivers."""

    def __init__(self):
        self.renderer = SlowRenderer()
        self.results = []
        self.worker = EngineWorker(self._build, "slow")
        self.worker.resultReady.connect(self.results.append)
        self.worker.start()

    def _build(self):
        return RendererEngine(Drawer(self.renderer, 1.0))

    def begin(self, request):
        """Ask, and wait for the first rendering to begin."""
        self.worker.submit(request)
        assert self.renderer.begun.acquire(timeout=PATIENCE_S)


@pytest.fixture
def slow(qapp):
    harness = Harness()
    yield harness
    harness.worker.stop()
    harness.renderer.may_end.release(10_000)
    harness.worker.join()


@pytest.fixture(params=sorted(QUESTIONS))
def ask(request):
    question = QUESTIONS[request.param]
    return lambda number: replace(question, sequence=number, channel=CHANNEL)


def test_what_is_called_off_ends_with_the_present_rendering_and_the_next_begins(qtbot, slow, ask):
    slow.begin(ask(1))
    slow.worker.abandon(CHANNEL)
    slow.renderer.may_end.release()
    slow.begin(make_request(2))
    assert slow.renderer.renderings == 2
    slow.renderer.may_end.release(10_000)
    qtbot.waitUntil(lambda: len(slow.results) == 1)
    assert slow.results[0].request.sequence == 2


def test_a_newer_question_of_its_kind_ends_it_and_is_answered(qtbot, slow, ask):
    slow.begin(ask(1))
    slow.worker.submit(ask(2))
    slow.renderer.may_end.release()
    assert slow.renderer.begun.acquire(timeout=PATIENCE_S)
    slow.renderer.may_end.release(10_000)
    qtbot.waitUntil(lambda: len(slow.results) == 1)
    assert slow.results[0].request.sequence == 2


def test_as_the_window_closes_it_ends_with_the_present_rendering(qtbot, slow, ask):
    slow.begin(ask(1))
    with qtbot.waitSignal(slow.worker.finished):
        slow.worker.stop()
        slow.renderer.may_end.release()
    slow.worker.join()
    assert slow.renderer.renderings == 1
    assert slow.results == []
