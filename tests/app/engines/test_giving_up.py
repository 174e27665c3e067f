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
from model.rendering.raster import Raster
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
        self.begun, self.may_end = threading.Semaphore(0), threading.Semaphore(0)
        self.renderings = 0

    def render(self, inputs, size=0, *_, go_on=lambda: None):
        self.renderings += 1
        self.begun.release()
        assert self.may_end.acquire(timeout=PATIENCE_S)
        go_on()
        return np.ones((*Raster.of(size).shape, 4), np.float32)


class Harness:
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
    harness = Harness()
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
