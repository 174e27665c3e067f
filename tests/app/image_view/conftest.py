from __future__ import annotations

import pytest

from app.engines.client import EngineClient
from app.image_view.engine_pane import EnginePane
from app.state.brightness import Brightness
from app.state.preferences import Preferences


@pytest.fixture
def pane(qtbot):
    """A pane of a client that has no engine yet."""
    preferences = Preferences(None)
    pane = EnginePane("Engine", EngineClient("test"), Brightness(preferences, preferences), "exact")
    preferences.setParent(pane)
    qtbot.addWidget(pane, before_close_func=_close)
    return pane


def _close(pane: EnginePane) -> None:
    pane.client.stop()
    pane.client.join()
