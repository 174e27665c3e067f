"""Order in which the engines of an opened volume begin."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot
from window_fakes import FakeBuilders, FakeEngine, make_request

import app.state.start_order as start_order
from app.engines.client import Channel, EngineClient
from app.engines.requests import ImageRequest
from app.engines.states import EngineState
from app.state.generator_work import GeneratorWork
from app.state.start_order import StartOrder


class Start:
    """The three clients, with a reference that is held back."""

    def __init__(self) -> None:
        self.builders = FakeBuilders()
        names = "generator", "reference", "analyst"
        self.generator, self.reference, self.analyst = (EngineClient(name) for name in names)
        self.model = GeneratorWork(
            self.generator, self.builders.make(), "auto", parent=self.generator
        )
        self.stand_in = Channel(self.analyst, "stand-in", self.analyst)
        self.order = StartOrder(
            self.generator, self.reference, self.stand_in, self.model, parent=self.generator
        )

    def begin(self) -> None:
        self.reference.start(FakeEngine, "Loading …", held=True)
        self.analyst.start(FakeEngine, "Loading …")

    def draw(self) -> None:
        """Have the ray caster draw."""
        image = make_request(1)
        self.stand_in.ask(ImageRequest(image.inputs, image.quality, stands_in=True))


@pytest.fixture
def start(qtbot: QtBot) -> Iterator[Start]:
    start = Start()
    yield start
    start.order.stop()
    for client in (start.generator, start.reference, start.analyst):
        client.stop()
        client.join()


def test_without_a_model_vtk_follows_the_ray_casters_picture(qtbot: QtBot, start: Start) -> None:
    start.begin()
    with qtbot.waitSignal(start.analyst.engineReady):
        pass
    assert start.order.is_under_way
    with qtbot.waitSignal(start.order.done):
        start.draw()
    assert not start.order.is_under_way


def test_a_model_comes_before_vtk(qtbot: QtBot, start: Start) -> None:
    start.model.open(Path("model"), None, held=True)
    start.begin()
    with qtbot.waitSignal(start.stand_in.answered):
        start.draw()
    assert start.order.is_under_way
    with qtbot.waitSignal(start.generator.engineReady):
        pass
    with qtbot.waitSignal(start.order.done):
        start.generator.submit(make_request(1))
    assert start.generator.state is EngineState.SETTLED


def test_a_ray_caster_that_fails_or_takes_long_holds_nothing_up(
    qtbot: QtBot, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> FakeEngine:
        raise MemoryError

    start.begin()
    with qtbot.waitSignal(start.order.done):
        start.analyst.start(fail, "Loading …")
    monkeypatch.setattr(start_order, "FIRST_MS", 20)
    with qtbot.waitSignal(start.order.done):
        start.begin()
    assert not start.order.is_under_way
