"""Speed against accuracy: the slider from fast to exact, and the line with the image's error."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QHideEvent
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QSlider,
    QVBoxLayout,
    QWidget,
)

from app import theme
from app.controls import Painted, WheelGuard, fill, label, text_button, wrapped
from app.engines.client import EngineState
from app.engines.exactness import STOPS, Stop
from app.engines.pace import SCALES
from app.image_view.engine_pane import PLACE, EnginePane
from app.image_view.orientation_cube import OrientationCube
from app.state.image_errors import (
    LEAST_SHOWN,
    Fidelity,
    ImageErrors,
    TradeOffPoint,
    error_text,
    figures_text,
    pace_text,
    rate_text,
)
from app.state.reference_choices import ReferenceChoices
from app.state.reference_image import ReferenceImage
from app.state.viewer_state import ViewerState

HEIGHT = 22

BELOW_CUBE, BELOW_CAPTION = 76, 36  # distance to the canvas's upper edge, in pixels

WHAT = (
    "Error (RMSE): how far the image's colours, from 0 to 1, are from those of the exact image, "
    "in the mean over all pixels."
)


class FidelityLine(QLabel):
    """Says how wrong an image is, why, and how it gets better; empty for an exact image.

    The text is also the accessible name.
    """

    judged = Signal(str)  # emitted with measured rate and error of moving images; may be empty

    def __init__(self, pane: EnginePane, state: ViewerState, work: ReferenceImage) -> None:
        super().__init__(pane.canvas)
        self._pane, self._state, self._work = pane, state, work
        self._errors = ImageErrors()
        self.fidelity = Fidelity()
        self.setProperty("role", "on image")
        self.hide()
        for signal, slot in (
            (pane.resultShown, lambda result: self._errors.note(result, work.raster, state.live)),
            (pane.statusShown, self._show),
            (pane.client.stateChanged, self._follow),
            (state.inputsChangeFinished, self._show),
            (work.choicesChanged, self._show),
        ):
            signal.connect(slot)

    def _follow(self, state: EngineState) -> None:
        if state is EngineState.LOADING:
            self._errors.forget()
        self._show()

    def _show(self) -> None:
        self.fidelity = Fidelity()
        client, live = self._pane.client, self._state.live
        if self._pane.shows_present and client.images.newest is not None:
            is_last = self._work.settings == self._work.wanted  # not another renderer's
            settled = client.state is EngineState.SETTLED and is_last
            asked = client.images.newest.inputs
            self.fidelity = self._errors.fidelity(asked, live, settled, self._work.raster)
        text = self.fidelity.text
        if text == self.text() and live:
            # The rest follows once nothing moves.
            return
        if text != self.text():
            self.setText(text)
            self.setAccessibleName(text)
        lines = (*self.fidelity.reasons, WHAT) if self.fidelity.error else self.fidelity.reasons
        self.setToolTip(wrapped(lines))
        self._place()
        self.setVisible(bool(text))
        moving = self._errors.moving(STOPS[self._work.choices.stop])
        self.judged.emit("" if moving is None else figures_text(*moving))

    def _place(self) -> None:
        canvas = self._pane.canvas
        cubes = canvas.findChildren(OrientationCube)
        top = BELOW_CUBE if any(not cube.isHidden() for cube in cubes) else BELOW_CAPTION
        width = min(self.sizeHint().width(), max(canvas.width() - 2 * PLACE, 0))
        self.setGeometry(canvas.width() - PLACE - width, top, width, HEIGHT)


WIDTH, POPOVER_WIDTH, PLOT_HEIGHT = 76, 400, 140  # of the slider, and of what it opens, in pixels
WAITING = "Measured as soon as the image at rest is complete."
MEASURED = "Measured in this scene, with {} × {} pixels at rest."
STILL = "\nIn all pixels, a moving image differs by {}\nfrom that at rest, which {}."

WIDEST, UNKNOWN = "999 / s, error .0000", "measure speed"
"""The longest text, so that nothing moves as it changes, and the text without numbers."""

NAMES = list(STOPS)  # of the stops, from left to right
Stops = dict[TradeOffPoint, list[Stop]]  # by the image that they lead to
MARGIN = 10  # around the figures, in pixels
LEAST_WIDTH = 34  # of a button in the bar, in pixels


class TradeOffPlot(pg.PlotWidget):  # type: ignore[misc]
    """Error over time of images of all sizes while something moves; stops have their names."""

    def __init__(self) -> None:
        super().__init__(background=None)
        self.setFixedHeight(PLOT_HEIGHT)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.hideButtons()
        for side, what in (("left", "error"), ("bottom", "milliseconds per image")):
            self.setLabel(side, what)
            self.getAxis(side).enableAutoSIPrefix(False)

    def show_trade_off(self, found: Sequence[TradeOffPoint], stops: Stops, chosen: Stop) -> None:
        """Show what is measured, the chosen stop in the accent's colour."""
        self.clear()
        places = {image: (math.log10(image.seconds), image.error) for image in found}
        at = np.reshape([*places.values()] or [(0.0, 1.0)], (-1, 2))
        (first, top), (last, _) = at[0], at[-1]
        errors = [(0.0, "0"), (top, error_text(top))]
        self.setXRange(first, last, padding=0.1)
        self.setYRange(0, 1.5 * top)
        self.plot(at[: len(found)], pen=theme.DIM, symbol="o", symbolSize=4, symbolBrush=theme.DIM)
        times: list[tuple[float, str]] = []
        for image, names in stops.items():
            color = theme.CHANGE if chosen in names else theme.TEXT
            self.plot(np.array([places[image]]), symbol="o", symbolSize=9, symbolBrush=color)
            # Stops that are nearly as fast have their names above each other, and one time.
            near = sum(abs(places[image][0] - other) < (last - first) / 6 for other, _ in times)
            time = "" if near else f"{float(f'{1e3 * image.seconds:.2g}'):g}"
            times.append((places[image][0], time))
            part = (places[image][0] - first) / max(last - first, 1e-9)
            text = pg.TextItem(", ".join(names), color, anchor=(part, 1.3 + 0.8 * near))
            text.setPos(*places[image])
            self.addItem(text)
        for side, marks in (("bottom", times), ("left", errors if found else [])):
            self.getAxis(side).setTicks([marks])
            self.getAxis(side).setTextPen(theme.DIM)


class TradeOffPopover(QFrame):
    """Shows rate and error of moving images at each stop, measured while it is open."""

    def __init__(self, work: ReferenceImage, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self._trade_off, self._work = work.trade_off, work
        self.setProperty("role", "mode card")
        self.setFixedWidth(POPOVER_WIDTH)
        self.setAccessibleName("Speed against accuracy")
        self.status = label("", "dim")
        self.plot = TradeOffPlot()
        self.rows: dict[Stop, tuple[QLabel, QLabel, QLabel]] = {}
        """Labels of rate, error, and limits of the image at rest."""
        self._lay_out()
        work.trade_off.changed.connect(self.refresh)

    def open_below(self, button: QWidget) -> None:
        """Open below a button, as far to the right as it, and start measuring."""
        place = button.mapToGlobal(button.rect().bottomRight())
        self.refresh()
        self.adjustSize()
        self.move(place.x() - self.width(), place.y())
        self.show()
        self._trade_off.watch(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop measuring."""
        super().hideEvent(event)
        self._trade_off.watch(False)

    def refresh(self) -> None:
        """Show what is measured by now."""
        stops = self._trade_off.stops
        measured = {name: image for image, names in stops.items() for name in names}
        for name, (rate, error, rest) in self.rows.items():
            image = measured.get(name)
            rate.setText("" if image is None else rate_text(image.seconds))
            exact = image is not None and image.error < LEAST_SHOWN
            error.setText("exact" if exact else "" if image is None else error_text(image.error))
            rest.setText(self._rest_text(name))
        self.plot.show_trade_off(self._trade_off.found, stops, self._work.choices.stop)
        if stops:
            pixels = self._work.raster
            text = MEASURED.format(pixels.width, pixels.height) + _alike_text(stops)
            if (left := self._trade_off.found[-1].error) >= LEAST_SHOWN:
                is_traced = self._work.settings.lighting == "path"
                why = "has more samples" if is_traced else "VTK draws"
                text += STILL.format(error_text(left), why)
            self.status.setText(text)
        elif self._trade_off.begun:
            self.status.setText(f"Measuring {self._trade_off.begun} of {len(SCALES)} …")
        else:
            self.status.setText(WAITING)

    def _rest_text(self, name: Stop) -> str:
        if self._work.settings.lighting == "path":
            return f"refined to {error_text(STOPS[name].error)}"
        return f"{self._work.resting_distance(name):g} voxel steps".removeprefix("0")

    def _lay_out(self) -> None:
        title = label("Speed against accuracy, while something moves", "title")
        grid = QGridLayout()
        grid.setHorizontalSpacing(14)
        grid.setVerticalSpacing(2)
        for place, text in enumerate(("", "moving", "error", "at rest")):
            grid.addWidget(label(text, "dim"), 0, place)
        for number, (name, stop) in enumerate(STOPS.items(), 1):
            labels = QLabel(), QLabel(), QLabel()
            self.rows[name] = labels
            what = QLabel(f"{name.capitalize()}, {pace_text(stop)}")
            for place, each in enumerate((what, *labels)):
                grid.addWidget(each, number, place)
        grid.setColumnStretch(0, 1)
        parts = title, grid, self.plot, self.status
        fill(QVBoxLayout(self), *parts, margins=(12, 10, 12, 10), spacing=6)


def _alike_text(stops: Stops) -> str:
    """Say which stops draw the same here while something moves; empty if all differ."""
    for image, names in stops.items():
        if len(names) == len(STOPS):
            return f"\nAll stops are the same here: all pixels at {rate_text(image.seconds)}."
        if len(names) > 1:
            return f"\n{' and '.join(map(str.capitalize, names))} are the same here."
    return ""


class ExactnessSlider(QWidget):
    """Chooses between speed and accuracy, and shows measurements of both."""

    moving = Painted("", "_show_figures")  # measured rate and error of moving images

    def __init__(self, work: ReferenceImage) -> None:
        super().__init__()
        self._work = work
        self._ends = [label("fast", "dim"), label("exact", "dim")]
        self._is_folded = False
        self.slider = QSlider(Qt.Orientation.Horizontal)
        WheelGuard(self.slider)
        self.slider.setRange(0, len(NAMES) - 1)
        self.slider.setPageStep(1)
        self.slider.setFixedWidth(WIDTH)
        # Stops that are passed during a drag are not drawn.
        self.slider.setTracking(False)
        self.slider.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.figures = text_button("", "", lambda: self.popover.open_below(self.figures), "flat")
        fast, exact = self._ends
        row = QHBoxLayout(self)
        fill(row, fast, self.slider, exact, self.figures, margins=(4, 0, 4, 0), spacing=6)
        self.slider.valueChanged.connect(lambda number: work.choose(stop=NAMES[number]))
        self.slider.sliderMoved.connect(self._say)
        work.choicesChanged.connect(self._show)
        self._show(work.choices)
        self.set_folded(False)

    @cached_property
    def popover(self) -> TradeOffPopover:
        """Shows rate and error of all stops; built when it is first opened."""
        return TradeOffPopover(self._work, self)

    def set_folded(self, folded: bool) -> None:
        """Hide words and numbers, or show them again."""
        self._is_folded = folded
        for end in self._ends:
            end.setVisible(not folded)
        widest = UNKNOWN if folded else WIDEST
        width = self.fontMetrics().horizontalAdvance(widest) + MARGIN
        self.figures.setFixedWidth(max(width, LEAST_WIDTH))
        self._show_figures()

    def _show(self, choices: ReferenceChoices) -> None:
        with QSignalBlocker(self.slider):
            self.slider.setValue(NAMES.index(choices.stop))
        self._say(self.slider.value())
        self._show_figures()

    def _say(self, number: int) -> None:
        name, stop = NAMES[number].capitalize(), STOPS[NAMES[number]]
        moving = f"up to {pace_text(stop)}, with fewer pixels if need be"
        if math.isinf(stop.live_seconds):
            moving = "all pixels, however long they take"
        rest = f"all pixels; path-traced light is refined to an error of {error_text(stop.error)}"
        if stop.distance is not None:
            rest += ", and in other lights samples along rays are twice as dense"
        self.slider.setAccessibleName(f"From fast to exact: {name}")
        tip = (
            f"<qt><b>{name}</b><br>While something moves: {moving}.<br>At rest: {rest}.<br>"
            "The numbers are the rate of the last moving images, and their difference (RMSE) from "
            "the image at rest. Click them to measure all stops.</qt>"
        )
        for widget in (self.slider, self.figures, *self._ends):
            widget.setToolTip(tip)

    def _show_figures(self) -> None:
        said = f"Moving images: {self.moving}" if self.moving else "Speed and accuracy"
        self.figures.setText(UNKNOWN if self._is_folded else self.moving or UNKNOWN)
        self.figures.setAccessibleName(said)
