"""Objects that the parts of the window share."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtWidgets import QMainWindow

from app.engines.client import EngineClient
from app.image_view.engine_pane import EnginePane
from app.state.brightness import Brightness
from app.state.latent_state import LatentState
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.window.notices import Notices
from app.window.status_line import StatusLine


@dataclass(frozen=True)
class Context:
    """The window with its state, its two images, and the places where it says something."""

    window: QMainWindow
    preferences: Preferences
    state: ViewerState
    sensitivity: SensitivityState
    latent: LatentState
    brightness: Brightness
    workspace: Workspace
    analyst: EngineClient
    generator: EnginePane
    reference: EnginePane
    notices: Notices
    status: StatusLine

    @property
    def panes(self) -> tuple[EnginePane, EnginePane]:
        """Both images."""
        return self.generator, self.reference

    def fail(self, text: str, key: str = "") -> None:
        """Show an error; it replaces the one with the same key."""
        self.notices.add(text, key=key, tone="error")
