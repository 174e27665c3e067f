import pytest
from PySide6.QtWidgets import QWidget

from app.engines.client import EngineClient
from app.image_view.engine_pane import EnginePane
from app.image_view.gestures import ViewGestures
from app.state.viewer_state import ViewerState


@pytest.fixture
def pane(qtbot):
    state = ViewerState()
    pane = EnginePane("Engine", EngineClient("test"), state.brightness, "exact")
    state.setParent(pane)
    qtbot.addWidget(pane, before_close_func=_close)
    return pane


@pytest.fixture
def canvas(qtbot, state):
    """A widget whose gestures change the view."""
    widget = QWidget()
    widget.resize(200, 200)
    ViewGestures(widget, state)
    qtbot.addWidget(widget)
    widget.show()
    yield widget
    state.finish_view()


def _close(pane):
    pane.client.stop()
    pane.client.join()
