"""Pane of one engine's image: caption and canvas, connected to the engine's client."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app import theme
from app.engines.client import EngineClient
from app.engines.messages import ImageRequest, Result
from app.engines.states import EngineState
from app.image_view.image_canvas import ImageCanvas, to_qimage

WITHOUT_IMAGE = (EngineState.WAITING, EngineState.LOADING, EngineState.PAUSED)
"""States in which no image is shown."""

HEADER_HEIGHT = 30


class EnginePane(QWidget):
    """Shows one engine's image and its computation time.

    Parameters
    ----------
    title : str
    client : EngineClient
    """

    def __init__(self, title: str, client: EngineClient, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.client = client
        self.canvas = ImageCanvas(self)
        self._title = QLabel(title)
        self._title.setProperty("role", "title")
        # As high as the controls that may stand beside it, so that images stay side by side.
        self._title.setMinimumHeight(HEADER_HEIGHT)
        self._detail = QLabel()
        self._detail.setProperty("role", "dim")
        # Wide enough for any numbers, so that changing digits do not move the layout.
        self._detail.setMinimumWidth(240)
        self._detail.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self._header = QHBoxLayout()
        self._header.setContentsMargins(2, 0, 2, 0)
        self._header.addWidget(self._title)
        self._header.addStretch()
        self._header.addWidget(self._detail)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addLayout(self._header)
        layout.addWidget(self.canvas, 1)
        client.stateChanged.connect(self._show_state)
        client.resultReady.connect(self._show_result)
        self._show_state(client.state)

    def set_title(self, title: str) -> None:
        """Set the engine's title."""
        self._title.setText(title)

    def set_hint(self, text: str) -> None:
        """Show a small hint over the image."""
        self.canvas.set_hint(text)

    def add_to_header(self, widget: QWidget) -> None:
        """Add a control between the title and the numbers."""
        self._header.insertWidget(1, widget)

    @property
    def title(self) -> str:
        """Title of the pane."""
        return self._title.text()

    @property
    def detail(self) -> str:
        """Displayed engine description, size and latency of the last image."""
        return self._detail.text()

    def _show_state(self, state: EngineState) -> None:
        if state in WITHOUT_IMAGE:
            self._detail.clear()
            self.canvas.set_hint("")
            self.canvas.show_image(None)
            self.canvas.show_message(self.client.text)
        elif state is EngineState.FAILED:
            self.canvas.show_message(self.client.text, theme.ERROR)

    def _show_result(self, result: Result) -> None:
        if not isinstance(result.request, ImageRequest) or result.value is None:
            return
        image = to_qimage(result.value)
        self.canvas.show_image(image)
        facts = [
            self.client.description,
            f"{image.width()} × {image.height()}",
            f"{1000 * result.seconds:.0f} ms",
        ]
        self._detail.setText("   ".join(fact for fact in facts if fact))
