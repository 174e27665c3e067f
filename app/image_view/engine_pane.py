"""Pane of one engine's image: caption and canvas, connected to the engine's client."""

from __future__ import annotations

import html
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app import theme
from app.controls import ElidedLabel, quiet_button
from app.engines.client import EngineClient
from app.engines.messages import ImageRequest, Result, StandInRequest
from app.engines.states import EngineState
from app.image_view.image_canvas import ImageCanvas, to_qimage
from app.image_view.late_badge import LateBadge
from app.state.brightness import Brightness
from app.state.engine_chooser import EngineName

WITHOUT_IMAGE = (EngineState.WAITING, EngineState.LOADING, EngineState.PAUSED)
"""States in which no image is shown."""

STOOD_IN = (EngineState.LOADING, EngineState.WORKING, EngineState.SETTLED)
"""States in which another engine may stand in."""

HEADER_HEIGHT = 30

NOTE_WIDTH = 92
"""Room for the note beside the title, in pixels."""

PREPARING = "Preparing …"

FINER = "finer next   "
"""Begin of an image's caption until its engine has settled: it is not to be cut."""

LEAST_DETAIL, MOST_DETAIL = 120, 360
"""Least width of an image's caption in pixels, where what does not fit is in its tooltip; and the
most that it takes of a wide pane beside other controls."""

WIDE = 900
"""Width of a pane from which on its caption has room, in pixels."""


class EnginePane(QWidget):
    """Shows one engine's image and its computation time.

    Parameters
    ----------
    title : str
    client : EngineClient
    brightness : Brightness
    engine : {"exact", "learned"}
        Whose light its images have.
    stand_in : EngineClient, optional
        Another engine, whose images are shown until the engine's own are there.
    """

    imageShown = Signal(object, object)
    """Emitted with the inputs of an image and the image, float32 (H, W, 4)."""
    noteToggled = Signal(bool)
    """Emitted when the note beside the title is clicked, with whether it is on."""

    def __init__(
        self,
        title: str,
        client: EngineClient,
        brightness: Brightness,
        engine: EngineName,
        stand_in: EngineClient | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.client = client
        self.brightness = brightness
        self.engine: EngineName = engine
        self._newest = (-1, False)
        self._rgba: NDArray[np.float32] | None = None
        # The generator's images have one size, in a drag and at rest.
        self._refines = stand_in is not None
        self.canvas = ImageCanvas(self)
        self._badge = LateBadge(client, self.canvas)
        self._title = QLabel(title)
        self._title.setProperty("role", "title")
        # As high as the controls that may stand beside it, so that images stay side by side.
        self._title.setMinimumHeight(HEADER_HEIGHT)
        # It takes what the controls leave: changing words and digits move nothing.
        self._detail = ElidedLabel()
        self._detail.setProperty("role", "dim")
        self._detail.setMinimumWidth(LEAST_DETAIL)
        self._detail.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self._header = QHBoxLayout()
        self._header.setContentsMargins(2, 0, 2, 0)
        self._note = quiet_button("", "")
        self._note.setProperty("role", "note")
        self._note.setCheckable(True)
        # A model's has room that stays: panes keep their widths when it comes and goes.
        kept = self._note.sizePolicy()
        kept.setRetainSizeWhenHidden(engine == "learned")
        self._note.setSizePolicy(kept)
        self._note.setMinimumWidth(NOTE_WIDTH)
        self._note.setVisible(False)
        self._note.toggled.connect(self.noteToggled)
        self._header.addWidget(self._title)
        self._header.addWidget(self._note)
        self._header.addWidget(self._detail, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addLayout(self._header)
        layout.addWidget(self.canvas, 1)
        client.stateChanged.connect(self._show_state)
        client.resultReady.connect(self._show_result)
        if stand_in is not None:
            stand_in.resultReady.connect(partial(self._show_stand_in, stand_in))
        brightness.changed.connect(self._show_brightness)
        self._show_state(client.state)

    def set_hint(self, text: str) -> None:
        """Show a small hint over the image."""
        self.canvas.set_hint(text)

    def set_note(self, text: str, tip: str = "") -> None:
        """Say something about the image beside the title; empty for nothing.

        Who clicks on it wants to see it: :attr:`noteToggled`.
        """
        self._note.setText(text)
        self._note.setToolTip(tip)
        self._note.setVisible(bool(text))

    @property
    def note(self) -> str:
        """The text about the image beside the title."""
        return self._note.text()

    def toggle_note(self) -> None:
        """Do what a click on the note does."""
        self._note.toggle()

    def add_to_header(self, widget: QWidget, stretch: int = 0) -> None:
        """Add a control in front of the numbers, as wide as it must be or as there is room."""
        self._header.insertWidget(self._header.count() - 1, widget, stretch)

    def set_title(self, title: str, tip: str = "") -> None:
        """Name who draws the pane's images; the tooltip tells more."""
        self._title.setText(title)
        # As rich text it is wrapped.
        self._title.setToolTip(f"<qt>{html.escape(tip)}</qt>" if tip else "")

    @property
    def title(self) -> str:
        """Title of the pane."""
        return self._title.text()

    @property
    def detail(self) -> str:
        """Displayed engine description, size and latency of the last image."""
        return self._detail.full_text

    def _show_state(self, state: EngineState) -> None:
        has_image = self.canvas.image is not None and not self.canvas.message
        if state is EngineState.LOADING and not self.client.text and has_image:
            # Another engine for the same volume: the last image stays until there is a new one.
            return
        if state in WITHOUT_IMAGE:
            self._newest = (-1, False)
            self._rgba = None
            self._detail.set_full_text("")
            self.canvas.set_hint("")
            self.canvas.show_image(None)
            self.canvas.show_message(self.client.text or PREPARING)
        elif state is EngineState.FAILED:
            self.canvas.show_message(self.client.text, theme.ERROR)
        elif state is EngineState.SETTLED:
            # Nothing follows.
            self._detail.set_full_text(self.detail.removeprefix(FINER), self.client.remark)
            self._detail.setStyleSheet("")

    def _show_result(self, result: Result) -> None:
        if isinstance(result.request, ImageRequest) and result.value is not None:
            self._show(result, self.client.description)
            if self._refines or not result.request.quality.live:
                self._detail.set_full_text(FINER + self.detail, self.client.remark)
                self._detail.setStyleSheet(f"color: {theme.ACCENT}")

    def _show_stand_in(self, stand_in: EngineClient, result: Result) -> None:
        wanted = isinstance(result.request, StandInRequest) and result.value is not None
        if wanted and self.client.state in STOOD_IN:
            name = stand_in.description
            own = self.client.description or "reference"
            at_rest = "moving" if result.request.quality.live else f"{own} next"
            self._show(result, f"{name}, {at_rest}")

    def _show(self, result: Result, by: str) -> None:
        """Show an image unless a newer one is there, or the engine's own of the same inputs."""
        request = result.request
        place = request.sequence, not isinstance(request, StandInRequest)
        if place < self._newest:
            return
        self._newest = place
        rgba = result.value
        assert rgba is not None
        self._rgba = rgba
        self._badge.note(request.inputs)
        self.canvas.show_image(to_qimage(rgba, self.brightness.of(self.engine)))
        height, width, _ = rgba.shape
        # Models draw the whole volume, and a hint says so.
        cropped = "cropped" if request.inputs.crop and self.engine == "exact" else ""
        facts = [cropped, by, f"{width} × {height}", f"{1000 * result.seconds:.0f} ms"]
        self._detail.set_full_text("   ".join(filter(None, facts)), self.client.remark)
        if self.width() > WIDE:
            # Once there, the room for a longer caption stays: nothing slides back and forth.
            needed = self._detail.fontMetrics().horizontalAdvance(self.detail + FINER) + 4
            self._detail.setMinimumWidth(max(self._detail.minimumWidth(), min(needed, MOST_DETAIL)))
        self.imageShown.emit(result.request.inputs, rgba)

    def _show_brightness(self) -> None:
        if self._rgba is not None:
            brightness = self.brightness.of(self.engine)
            self.canvas.replace_image(to_qimage(self._rgba, brightness))
