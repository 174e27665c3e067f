from __future__ import annotations

from dataclasses import replace

import pytest
from pytestqt.qtbot import QtBot
from window_fakes import FakeEngine, make_request

from app.engines.requests import ImageRequest, Quality
from app.image_view.engine_pane import EnginePane
from app.image_view.exactness_slider import FidelityLine
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.view import View

MOVING = Quality(8, live=True)


@pytest.fixture
def line(pane: EnginePane) -> FidelityLine:
    pane.resize(700, 500)
    pane.show()
    return FidelityLine(pane, ViewerState(pane), lambda: Raster(8, 8), lambda: False)


def request(line: FidelityLine, sequence: int) -> ImageRequest:
    """A request for an image of the present inputs."""
    return replace(make_request(sequence), inputs=line._state.inputs)


def test_it_is_there_for_what_is_not_exact_alone(qtbot: QtBot, line: FidelityLine) -> None:
    pane, engine = line._pane, FakeEngine()
    pane.client.start(lambda: engine, "Loading …")
    assert line.isHidden()
    with qtbot.waitSignal(pane.client.settled):
        pane.client.submit(request(line, 1))
    assert line.isHidden() and line.said == ""
    engine.image_error = 0.0123
    with qtbot.waitSignal(pane.client.settled):
        pane.client.submit(request(line, 2))
    words = "error .012"
    assert not line.isHidden() and line.said == line.text() == line.accessibleName() == words
    assert "1 sample per pixel" in line.toolTip() and "RMSE" in line.toolTip()
    line._passes = lambda: True
    pane.statusShown.emit()
    assert line.said == "error .012, refining"
    # In the upper right corner, below the caption.
    assert line.geometry().right() <= pane.canvas.width() and line.y() > pane.caption.y()
    # Neither of a picture that covers the image, nor of an error.
    pane.name_cover("Preview")
    assert line.isHidden()
    pane.name_cover("")
    assert not line.isHidden()
    pane.client.fail("It failed.")
    assert line.isHidden()


def test_it_has_time_and_error_of_the_last_moving_image(qtbot: QtBot, line: FidelityLine) -> None:
    pane = line._pane
    state = line._state
    pane.client.start(FakeEngine, "Loading …")
    state.move_view(View(70.0))
    pane.client.submit(replace(request(line, 51), quality=MOVING))
    qtbot.waitUntil(lambda: pane.canvas.image is not None)
    # The red channel is the number of the request: 51 / 255 off, in one of three channels.
    state.finish_view()
    with qtbot.waitSignal(pane.client.settled):
        pane.client.submit(request(line, 102))
    assert line.said == ""
    assert line.moving.endswith(" / s, error .12")
    state.move_view(View(80.0))
    pane.client.submit(replace(request(line, 103), quality=MOVING))
    qtbot.waitUntil(lambda: line.said == "coarser while moving")
    # As wide as what it says.
    wide = line.width()
    state.finish_view()
    qtbot.waitUntil(lambda: line.said == "refining")
    assert line.width() < wide
