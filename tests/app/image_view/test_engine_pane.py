from __future__ import annotations

import threading

import pytest
from pytestqt.qtbot import QtBot
from window_fakes import PATIENCE_S, FakeEngine, make_request

from app.image_view.engine_pane import EnginePane
from model.errors import CheckpointError, RenderError


@pytest.fixture
def pane(qtbot: QtBot) -> EnginePane:
    pane = EnginePane("Engine", "test")
    qtbot.addWidget(pane, before_close_func=close)
    return pane


def close(pane: EnginePane) -> None:
    pane.stop()
    pane.join()


def red(pane: EnginePane) -> int:
    """Sequence number of the image that is shown."""
    assert pane.canvas.image is not None
    return pane.canvas.image.pixelColor(0, 0).red()


def test_it_says_what_it_waits_for_then_shows_image_and_facts(
    qtbot: QtBot, pane: EnginePane
) -> None:
    pane.start(lambda: FakeEngine(description="CPU"), "Loading …")
    assert pane.canvas.message == "Loading …"
    assert not pane.is_settled
    with qtbot.waitSignal(pane.settled):
        pane.submit(make_request(7))
    assert red(pane) == 7
    assert pane.canvas.message == ""
    device, *size, milliseconds, unit = pane.detail.split()
    assert device == "CPU"
    assert size == ["8", "×", "8"]
    assert float(milliseconds) >= 0
    assert unit == "ms"


def test_a_live_image_is_shown_but_does_not_settle(qtbot: QtBot, pane: EnginePane) -> None:
    pane.start(FakeEngine, "Loading …")
    with qtbot.assertNotEmitted(pane.settled):
        pane.submit(make_request(3, live=True))
        qtbot.waitUntil(lambda: pane.canvas.image is not None)
    assert red(pane) == 3
    assert not pane.is_settled


def test_an_error_is_drawn_over_the_image_and_the_next_image_clears_it(
    qtbot: QtBot, pane: EnginePane
) -> None:
    engine = FakeEngine()
    pane.start(lambda: engine, "Loading …")
    with qtbot.waitSignal(pane.settled):
        pane.submit(make_request(1))
    engine.error = RenderError("The volume does not fit; close other programs.")
    with qtbot.waitSignal(pane.settled):
        pane.submit(make_request(2))
    assert pane.error == pane.canvas.message == "The volume does not fit; close other programs."
    assert red(pane) == 1
    engine.error = None
    with qtbot.waitSignal(pane.settled):
        pane.submit(make_request(3))
    assert pane.error is None
    assert red(pane) == 3


def test_an_engine_that_cannot_be_built_is_an_error(qtbot: QtBot, pane: EnginePane) -> None:
    def fail() -> FakeEngine:
        raise CheckpointError("model: the folder is missing.")

    with qtbot.waitSignal(pane.settled):
        pane.start(fail, "Loading …")
    assert pane.error == "model: the folder is missing."


def test_a_paused_pane_ignores_requests_until_resumed(qtbot: QtBot, pane: EnginePane) -> None:
    engine = FakeEngine()
    with qtbot.waitSignal(pane.engineReady):
        pane.start(lambda: engine, "Loading …")
    pane.pause("Not for this volume.")
    assert pane.is_settled
    pane.submit(make_request(1))
    assert pane.canvas.message == "Not for this volume."
    pane.resume()
    with qtbot.waitSignal(pane.settled):
        pane.submit(make_request(2))
    assert [r.sequence for r in engine.requests] == [2]


def test_a_replaced_engine_delivers_nothing_any_more(qtbot: QtBot, pane: EnginePane) -> None:
    gate = threading.Semaphore(0)
    slow = FakeEngine(gate=gate)
    pane.start(lambda: slow, "Loading …")
    pane.submit(make_request(1))
    assert slow.started.acquire(timeout=PATIENCE_S)
    pane.start(FakeEngine, "Loading another …")
    with qtbot.waitSignal(pane.settled):
        pane.submit(make_request(2))
    gate.release()
    qtbot.waitUntil(lambda: slow.closed)
    qtbot.waitUntil(lambda: pane._retired == [])
    assert red(pane) == 2
