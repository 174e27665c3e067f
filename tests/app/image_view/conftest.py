from __future__ import annotations

import pytest

from app.engines.client import EngineClient
from app.image_view.engine_pane import EnginePane
from app.state.viewer_state import ViewerState


@pytest.fixture
def pane(qtbot):
    """A pane of a client that has no engine yet."""
    state = ViewerState()
    pane = EnginePane("Engine", EngineClient("test"), state.brightness, "exact")
    state.setParent(pane)
    qtbot.addWidget(pane, before_close_func=_close)
    return pane


def _close(pane: EnginePane) -> None:
    pane.client.stop()
    pane.client.join()
