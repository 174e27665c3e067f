"""The slider from fast to exact, with rate and error of images while something moves."""

from __future__ import annotations

import math
from functools import cached_property

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSlider, QToolButton, QWidget

from app.engines.exactness import STOPS
from app.image_view.fidelity_line import FidelityLine
from app.image_view.trade_popover import TradePopover
from app.state.image_errors import error_text, pace_text
from app.state.reference_work import ReferenceChoices, ReferenceWork
from app.wheel_guard import WheelGuard

WIDTH = 76
"""Of the slider, in pixels."""

WIDEST, UNKNOWN = "999 / s, error .0000", "…"
"""As long as figures get, so that nothing moves as they change, and what is there without any."""

NAMES = list(STOPS)
"""Of the stops, from left to right."""

MARGIN = 10
"""Around the figures, in pixels."""

LEAST_WIDTH = 34
"""Of a button in the bar, in pixels."""


class ExactnessSlider(QWidget):
    """Chooses between speed and accuracy, and says what both are here.

    Its figures are measured: they are those of the last image while something moved, compared
    with the one at rest. Each choice draws both. A click on them measures those of all stops.
    """

    def __init__(self, work: ReferenceWork) -> None:
        super().__init__()
        self._work = work
        self._line: FidelityLine | None = None
        self._ends = [QLabel("fast"), QLabel("exact")]
        self._is_folded = False
        self.slider = QSlider(Qt.Orientation.Horizontal)
        WheelGuard(self.slider)
        self.slider.setRange(0, len(NAMES) - 1)
        self.slider.setPageStep(1)
        self.slider.setFixedWidth(WIDTH)
        # What is dragged over is not drawn.
        self.slider.setTracking(False)
        self.slider.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.figures = QToolButton()
        self.figures.setProperty("role", "flat")
        self.figures.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.figures.clicked.connect(self.open_popover)
        for label in self._ends:
            label.setProperty("role", "dim")
        row = QHBoxLayout(self)
        row.setContentsMargins(4, 0, 4, 0)
        row.setSpacing(6)
        for widget in (self._ends[0], self.slider, self._ends[1], self.figures):
            row.addWidget(widget)
        self.slider.valueChanged.connect(lambda number: work.choose(stop=NAMES[number]))
        self.slider.sliderMoved.connect(self._say)
        work.choicesChanged.connect(self._show)
        self._show(work.choices)
        self.set_folded(False)

    @cached_property
    def popover(self) -> TradePopover:
        """Shows rate and error of all stops; built when it is first opened."""
        return TradePopover(self._work, self)

    def follow(self, line: FidelityLine) -> None:
        """Have the figures of the images that a line judges."""
        self._line = line
        line.judged.connect(self._show_figures)

    def set_folded(self, folded: bool) -> None:
        """Leave words and figures out, or show them again."""
        self._is_folded = folded
        for label in self._ends:
            label.setVisible(not folded)
        widest = UNKNOWN if folded else WIDEST
        width = self.fontMetrics().horizontalAdvance(widest) + MARGIN
        self.figures.setFixedWidth(max(width, LEAST_WIDTH))
        self._show_figures()

    def open_popover(self) -> None:
        """Show rate and error of all stops."""
        self.popover.open_below(self.figures.mapToGlobal(self.figures.rect().bottomRight()))

    def _show(self, choices: ReferenceChoices) -> None:
        with QSignalBlocker(self.slider):
            self.slider.setValue(NAMES.index(choices.stop))
        self._say(self.slider.value())
        self._show_figures()

    def _say(self, number: int) -> None:
        """Say what a stop means, in tooltip and accessible name."""
        name, stop = NAMES[number].capitalize(), STOPS[NAMES[number]]
        moving = f"up to {pace_text(stop)}, with fewer pixels if need be"
        if math.isinf(stop.live_seconds):
            moving = "all pixels, however long they take"
        rest = f"all pixels; path-traced light is refined to an error of {error_text(stop.error)}"
        if stop.distance is not None:
            rest += ", and in other light samples are twice as close"
        self.slider.setAccessibleName(f"From fast to exact: {name}")
        tip = (
            f"<qt><b>{name}</b><br>While something moves: {moving}.<br>At rest: {rest}.<br>"
            "The figures are measured: rate and error (RMSE) of the last images while something "
            "moved. Click them to measure all stops.</qt>"
        )
        for widget in (self.slider, self.figures, *self._ends):
            widget.setToolTip(tip)

    def _show_figures(self) -> None:
        text = "" if self._line is None else self._line.moving
        self.figures.setText(UNKNOWN if self._is_folded else text or UNKNOWN)
        self.figures.setAccessibleName(f"Moving images: {text}" if text else "Speed and accuracy")
