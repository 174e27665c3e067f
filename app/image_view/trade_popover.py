"""Costs of the steps from fast to exact in the present scene, as a plot and rows to choose."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPoint, QSignalBlocker, Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QButtonGroup,
    QFrame,
    QGridLayout,
    QLabel,
    QRadioButton,
    QVBoxLayout,
    QWidget,
)

from app import theme
from app.state.exactness import STEPS
from app.state.fidelity import LEAST_SAID, error_text
from app.state.live_errors import Kind, LiveError, LiveErrors
from app.state.pace import SCALES
from app.state.reference_choices import ReferenceChoices
from app.state.reference_work import ReferenceWork
from app.state.trade_keeper import Traded

WIDTH, PLOT_HEIGHT = 440, 170

TIMES = [(value, f"{value:g}") for value in (1, 3, 10, 30, 100, 300, 1000, 3000, 10_000)]
ERRORS = [(LEAST_SAID, "0"), *((value, error_text(value)) for value in (0.001, 0.01, 0.1, 1.0))]
"""Marks of the axes: milliseconds, and errors from those that are none."""

PREDICTED = 0.5
"""Opacity of the plot's dots while other scenes predict them."""

EXACT = "exact"
"""Said of errors that are less than noise."""

WAITING = "Measured once the image at rest is there."
MEASURING = "Measuring {} of {} …"
MEASURED = "Measured here, in this scene: {}."
EXPECTED = "~ is predicted by {}, measured on this machine."


ANSWERS: dict[Kind, str] = {
    "curve": "Sensitivity curve, while it moved:",
    "field": "Field of a value, while it moved:",
    "map": "A picture of the map of TFs, while it moved:",
}


class TradePopover(QFrame):
    """Shows time against error of images while something moves, and what each step makes of it.

    The plot's dots are images with fewer or more pixels; its lines are the times that the steps
    allow. A click at a time takes the step that allows it, as its row does.
    """

    def __init__(self, work: ReferenceWork, answers: LiveErrors, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self._trade, self._work, self._answers = work.trade, work, answers
        self.setProperty("role", "mode card")
        self.setFixedWidth(WIDTH)
        self.setAccessibleName("Speed against accuracy")
        self.plot: Any = pg.PlotWidget()
        self._dots: Any = pg.PlotDataItem(symbolSize=7)
        self._lines: list[Any] = [pg.InfiniteLine() for _step in STEPS]
        self.status = QLabel()
        self.answers = QLabel()
        self._choice = QButtonGroup(self)
        self.rows: list[tuple[QRadioButton, QLabel, QLabel, QLabel]] = []
        self._lay_out()
        work.trade.changed.connect(self.refresh)
        work.choicesChanged.connect(self._show_choice)
        answers.changed.connect(self._show_answers)
        self._choice.idClicked.connect(self._choose)

    def open_below(self, place: QPoint) -> None:
        """Open with the upper right corner at a place of the screen."""
        self._show_answers()
        self.adjustSize()
        self.move(place.x() - self.width(), place.y())
        self.show()
        self.rows[self._work.choices.exactness][0].setFocus(Qt.FocusReason.PopupFocusReason)

    def showEvent(self, event: QShowEvent) -> None:
        """Measure what is to be shown."""
        super().showEvent(event)
        self._paint()
        self._show_choice(self._work.choices)
        self._trade.watch(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Measure no more."""
        super().hideEvent(event)
        self._trade.watch(False)

    def changeEvent(self, event: QEvent) -> None:
        """Follow the theme."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._paint()

    def refresh(self) -> None:
        """Show what is measured by now."""
        found = self._trade.found
        shown = found or self._trade.predicted
        # Logarithms have no place for nothing.
        times = np.array([1e3 * max(each.seconds, 1e-5) for each in shown])
        errors = np.array([max(each.error, LEAST_SAID) for each in shown])
        self._dots.setData(times, errors)
        self._dots.setOpacity(1.0 if found else PREDICTED)
        if shown:
            # An axis of less than a decade would have no mark.
            top = max(10 * errors.min(), 1.5 * errors.max())
            self.plot.setYRange(np.log10(errors.min() / 1.5), np.log10(top))
        for number, (_button, time, error, rest) in enumerate(self.rows):
            traded, about = self._trade.at(STEPS[number]), ""
            if traded is None:
                traded, about = self._trade.expected(STEPS[number]), "~"
            time.setText("" if traded is None else about + _time_text(traded))
            error.setText("" if traded is None else about + _error_text(traded))
            rest.setText(self._rest_text(number))
        if self._trade.is_complete:
            pixels = self._work.whole_raster()
            text = MEASURED.format(f"{pixels.width} x {pixels.height} pixels at rest")
        elif self._trade.is_measuring:
            text = MEASURING.format(len(found) + 1, len(SCALES))
        else:
            text = WAITING
        scenes = self._trade.scenes
        if scenes and not self._trade.is_complete:
            others = f"{scenes} other scenes" if scenes > 1 else "another scene"
            text += "\n" + EXPECTED.format(f"{others} of this volume")
        self.status.setText(text)

    def _show_answers(self) -> None:
        """Say what the last answers while something moved took, and how near they were."""
        found = self._answers.found
        self.answers.setText("\n".join(_answer_text(kind, found[kind]) for kind in found))
        self.answers.setVisible(bool(found))

    def _rest_text(self, number: int) -> str:
        """Say what an image at rest comes to: an error, or how far samples are apart."""
        if self._work.settings_at(number).lighting == "path":
            found = self._trade.at_rest(STEPS[number])
            if found is None:
                return f"refined to {error_text(STEPS[number].error)}"
            return f"~{_long_text(found[1])} to error {error_text(found[0])}"
        return f"{self._work.resting_distance(number):g} voxel steps".removeprefix("0")

    def _show_choice(self, choices: ReferenceChoices) -> None:
        button = self.rows[choices.exactness][0]
        with QSignalBlocker(self._choice):
            button.setChecked(True)
        for number, line in enumerate(self._lines):
            is_chosen = number == choices.exactness
            color = theme.CHANGE if is_chosen else theme.DIM_TEXT
            line.setPen(pg.mkPen(color, width=2 if is_chosen else 1, style=_style(is_chosen)))
        self.refresh()

    def _choose(self, number: int) -> None:
        self._work.choose(exactness=number)

    def _click(self, event: Any) -> None:
        """Take the step whose time is nearest to where the plot was clicked."""
        view = self.plot.getPlotItem().vb
        if not view.sceneBoundingRect().contains(event.scenePos()):
            return
        at = view.mapSceneToView(event.scenePos()).x()
        allowed = [np.log10(1e3 * step.live_seconds) for step in STEPS]
        self._choose(int(np.argmin(np.abs(np.array(allowed) - at))))

    def _lay_out(self) -> None:
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 10, 12, 10)
        column.setSpacing(6)
        title = QLabel("Speed against accuracy, while something moves")
        title.setProperty("role", "title")
        column.addWidget(title)
        self._lay_out_plot()
        column.addWidget(self.plot)
        grid = QGridLayout()
        grid.setHorizontalSpacing(14)
        grid.setVerticalSpacing(2)
        for place, text in enumerate(("", "takes", "error", "at rest")):
            heading = QLabel(text)
            heading.setProperty("role", "dim")
            grid.addWidget(heading, 0, place)
        for number, step in enumerate(STEPS):
            words = f"{step.name}, up" if step.name else "Up"
            button = QRadioButton(f"{words} to {1e3 * step.live_seconds:.0f} ms")
            row = button, QLabel(), QLabel(), QLabel()
            for place, widget in enumerate(row):
                grid.addWidget(widget, number + 1, place)
            self._choice.addButton(button, number)
            self.rows.append(row)
        grid.setColumnStretch(0, 1)
        column.addLayout(grid)
        for label in (self.status, self.answers):
            label.setProperty("role", "dim")
            label.setWordWrap(True)
            column.addWidget(label)
        self.answers.setAccessibleName("Answers while something moves")
        self.answers.setToolTip(
            "How long they took, and how near they were to those at rest, of all pixels: a cosine "
            "of 1 is the same curve or field"
        )

    def _lay_out_plot(self) -> None:
        self.plot.setFixedHeight(PLOT_HEIGHT)
        self.plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.plot.setAccessibleName("Error over the time of an image")
        item = self.plot.getPlotItem()
        item.setLogMode(x=True, y=True)
        item.setMouseEnabled(False, False)
        item.setMenuEnabled(False)
        item.hideButtons()
        for side, label, ticks in (
            ("bottom", "milliseconds an image", TIMES),
            ("left", "error (RMSE)", ERRORS),
        ):
            axis = item.getAxis(side)
            axis.enableAutoSIPrefix(False)
            axis.setLabel(label)
            axis.setTicks([[(np.log10(value), text) for value, text in ticks]])
        item.addItem(self._dots)
        for step, line in zip(STEPS, self._lines, strict=True):
            line.setPos(np.log10(1e3 * step.live_seconds))
            item.addItem(line, ignoreBounds=False)
        self.plot.scene().sigMouseClicked.connect(self._click)

    def _paint(self) -> None:
        """Take the theme's colours."""
        self.plot.setBackground(theme.PLOT)
        self._dots.setPen(pg.mkPen(theme.TEXT, width=1))
        self._dots.setSymbolBrush(theme.TEXT)
        self._dots.setSymbolPen(None)
        for side in ("bottom", "left"):
            axis = self.plot.getPlotItem().getAxis(side)
            axis.setPen(theme.DIM_TEXT)
            axis.setTextPen(theme.DIM_TEXT)


def _style(is_chosen: bool) -> Qt.PenStyle:
    return Qt.PenStyle.SolidLine if is_chosen else Qt.PenStyle.DashLine


def _answer_text(kind: Kind, found: LiveError) -> str:
    near = "" if found.error is None else f", error {error_text(found.error)}"
    if found.cosine is not None:
        near = f", cosine {found.cosine:.4f}".replace(" 0.", " .").replace("1.0000", "1")
    return f"{ANSWERS[kind]} {1e3 * found.seconds:.0f} ms{near}"


def _long_text(seconds: float) -> str:
    return f"{seconds:.2g} s" if seconds < 60 else f"{seconds / 60:.0f} min"


def _time_text(traded: Traded) -> str:
    return f"{1e3 * traded.seconds:.0f} ms"


def _error_text(traded: Traded) -> str:
    return error_text(traded.error) if traded.error >= LEAST_SAID else EXACT
