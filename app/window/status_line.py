"""The line at the lower edge: keys for the area under the mouse, news, the view's numbers."""

import html
import re

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLabel, QProgressBar, QStackedWidget, QStatusBar

from app import theme
from app.controls import ElidedLabel, Painted, announce, label, named
from app.engines.background import Pause
from app.number_box import MINUS
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.window.help_pages import status_keys
from model.scene.ranges import without_zero

HEIGHT = 24  # in pixels
NEWS_MS = 5_000  # time for which a sentence stays unless it is replaced
PENDING = "…"  # end of sentences about running work: they stay until the next one
PREPARED_WIDTH = 240  # of the progress of compiling, in pixels
NARROW = 1180  # width in pixels below which the view's numbers are hidden


class StatusLine(QStatusBar):
    """Shows the keys of the area that a widget's status tip names, or the newest sentence."""

    area = Painted("Images", "_name_keys")  # under the mouse; without one, the images
    keys = Painted("", "_show_keys")  # shown while there is no sentence

    def __init__(self, state: ViewerState, regions: SensitivityState) -> None:
        super().__init__()
        self._state, self._regions = state, regions
        self._is_empty = True
        self.setFixedHeight(HEIGHT)
        self.setContentsMargins(8, 0, 8, 0)
        self._news = ElidedLabel()
        # Only the first of its lines is seen: the hints that fit, each of them whole.
        self._hints = QLabel(textFormat=Qt.TextFormat.RichText, wordWrap=True)
        self._hints.setAlignment(Qt.AlignmentFlag.AlignTop)
        self._left = QStackedWidget()
        for each in (self._hints, self._news):
            each.setSizePolicy(self._news.sizePolicy())
            self._left.addWidget(each)
        self._left.setSizePolicy(self._news.sizePolicy())
        self._left.setFixedHeight(self._hints.fontMetrics().height())
        self.view = label("", "dim")
        self.view.setToolTip(
            "View: direction, distance (1 shows the whole volume), and pan to the right and up (1 "
            "is half the shorter side of the image)"
        )
        tip = "Renderers are compiled once per data type and light"
        self.prepared = named(QProgressBar(), tip=tip)
        self.prepared.setFixedSize(PREPARED_WIDTH, HEIGHT - 6)
        self.prepared.hide()
        self.addWidget(self._left, 1)
        self.addPermanentWidget(self.prepared)
        self.addPermanentWidget(self.view)
        self.setSizeGripEnabled(False)
        self._rest = Pause(self, NEWS_MS, lambda: self.say(""))
        for changed in (state.viewChanged, state.navigationChanged):
            changed.connect(self._show_view)
        regions.changed.connect(self._name_keys)
        # The sentence may be about the edit that was undone.
        state.edits.returning.connect(self._forget)
        self._show_view()
        self._name_keys()

    @property
    def news(self) -> str:
        """The whole sentence; empty if there is none."""
        return self._news.full_text

    def say(self, text: str) -> None:
        """Show a new sentence; an empty one brings the keys back."""
        self._news.full_text = text
        self._left.setCurrentWidget(self._news if text else self._hints)
        self._rest.stop()
        if text:
            announce(self, text)
        if text and not text.endswith(PENDING):
            self._rest.start()

    def show_preparation(self, done: int, wanted: int, text: str) -> None:
        """Show how many groups of kernels are compiled, and the time left."""
        self.prepared.setFormat(text.replace("%", "%%"))
        self.prepared.setMaximum(max(wanted, 1))
        self.prepared.setValue(done)
        self.prepared.setVisible(done < wanted)

    def start_volume(self) -> None:
        """Show the keys of images and plot, now that there is a volume."""
        self._is_empty = False
        self.view.setVisible(self.width() >= NARROW)
        self._name_keys()

    def _name_keys(self) -> None:
        """Show the keys of the running action in the area under the mouse."""
        area, regions = self.area, self._regions
        if area in ("Images", "Transfer function") and self._is_empty:
            area = "Files"
        elif area == "Transfer function" and regions.band is not None:
            area = "Value under the mouse"
        elif area == "Images" and regions.tool is not None:
            area = "Drawing a region"
        elif area == "Images" and regions.active is not None:
            area = "Regions"
        self.keys = status_keys(area)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Hide the view's numbers if there is no room for them."""
        super().resizeEvent(event)
        self.view.setVisible(self.width() >= NARROW and not self._is_empty)

    def changeEvent(self, event: QEvent) -> None:
        """Update the keys' colours after a change of theme."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and self.keys:
            self._show_keys()

    def _show_keys(self) -> None:
        chip = f"background-color: {theme.FIELD}; color: {theme.TEXT}"
        found = re.findall(r"\[([^]]*)\] ([^[]*)", self.keys)
        parts = []
        for each in found:
            # Lines are broken at the spaces between hints only.
            keys, effect = (html.escape(text.strip()).replace(" ", "&nbsp;") for text in each)
            parts.append(
                f"<span style='{chip}'>&nbsp;{keys}&nbsp;</span>"
                f"<span style='color: {theme.DIM}'>&nbsp;&nbsp;{effect}&nbsp;&nbsp;&nbsp;</span>"
            )
        self._hints.setText(" ".join(parts))

    def _forget(self) -> None:
        if not self.news.endswith(PENDING):
            self.say("")

    def _show_view(self) -> None:
        view = self._state.view
        azimuth, elevation, roll = self._state.angles
        rolled = f"roll {roll:.0f}°   " if round(roll) else ""
        text = f"azimuth {round(azimuth)}°   elevation {round(elevation)}°   {rolled}"
        text += f"distance {without_zero(f'{view.distance:.2f}')}"
        # The sum turns -0 into 0.
        pan_x, pan_y = (round(pan, 2) + 0.0 for pan in (view.pan_x, view.pan_y))
        if self._state.is_panned and (pan_x or pan_y):
            text += f"   pan {without_zero(f'{pan_x:+.2f}')}, {without_zero(f'{pan_y:+.2f}')}"
        if self._state.view.is_orthographic:
            text += "   orthographic"
        self.view.setText(text.replace("-", MINUS))
