"""The region's responses over the opacity curve, with visibility, band and peaks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QPointF, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QWheelEvent

from app import theme
from app.sensitivity_view.peak_flag import PeakFlag
from app.state.sensitivity_answers import RegionAnswer, displayed
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.handle import DragHandle
from app.tf_editor.plot_area import PlotArea
from model.scene.tf_perturbation import edit_over
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.value_text import value_text
from model.sensitivity.display import FLOOR, SMALL_EDIT
from model.sensitivity.intervals import Interval, promising_intervals

EXACT, LEARNED, BAND = "#56b4e9", "#e69f00", "#e05c5c"
VISIBLE = "#3fae7d"

AXIS_WIDTH = 64
BAND_HEIGHT = 0.92
VISIBLE_HEIGHT = 0.3
"""Heights of the band and of the visibility, as fractions of the plot."""

CLICK_REACH = 4

CANDIDATES = 5
"""Number of intervals among which those with a flag are chosen."""


class ResponseLayer(QObject):
    """Draws what the dispatcher was told over the opacity plot, and asks by the mouse there.

    Hovering shows where the value under the mouse is visible, and with Ctrl what an edit there
    would change; the wheel sets the edits' width,
    and dragging beside the handles pins a band of values, which a click there releases.

    Parameters
    ----------
    area : PlotArea
    state : ViewerState
    sensitivity : SensitivityState
    dispatcher : SensitivityDispatcher
    """

    intervalsChanged = Signal(object)
    """Emitted with the promising intervals, that with the strongest response first."""
    peakClicked = Signal(int)

    def __init__(
        self,
        area: PlotArea,
        state: ViewerState,
        sensitivity: SensitivityState,
        dispatcher: SensitivityDispatcher,
    ) -> None:
        super().__init__(area)
        self._area = area
        self._state = state
        self._sensitivity = sensitivity
        self._dispatcher = dispatcher
        self._view, self._axis = area.add_second_scale()
        self._axis.setWidth(AXIS_WIDTH + 12)
        self._limit = FLOOR
        self._pressed: QPointF | None = None
        self._edits = False
        """Whether a handle was moved since the mouse came to the plot."""
        self.promising: tuple[Interval, ...] = ()
        """Intervals that promise most, by the derivative."""
        self.intervals: tuple[Interval, ...] = ()
        """Those with a flag, the best one first."""
        self.is_flat = True
        self.strongest: float | None = None
        """Scalar value of the strongest response; None where no edit shows."""
        self._visible = _filled(VISIBLE, 70)
        self._visible_region = pg.PlotCurveItem(pen=pg.mkPen(VISIBLE, width=1.2), antialias=True)
        self._curves = {
            "exact": pg.PlotCurveItem(pen=pg.mkPen(EXACT, width=2), antialias=True),
            "learned": pg.PlotCurveItem(pen=pg.mkPen(LEARNED, width=2), antialias=True),
        }
        self._band = _filled(BAND, 110)
        ground = QColor(theme.BACKGROUND)
        ground.setAlpha(200)
        self._value = pg.TextItem(color=theme.TEXT, fill=ground)
        self._value.setZValue(90)
        area.opacity.addItem(self._value, ignoreBounds=True)
        self._zero = pg.InfiniteLine(0, angle=0, pen=pg.mkPen(theme.BORDER, width=1))
        area.opacity.addItem(self._visible, ignoreBounds=True)
        area.opacity.addItem(self._visible_region, ignoreBounds=True)
        area.opacity.addItem(self._band, ignoreBounds=True)
        self._visible.setZValue(-5)
        self._visible_region.setZValue(-4)
        self._cut = pg.ScatterPlotItem(size=9, pen=None)
        self._shown: dict[str, tuple[NDArray[np.float64], Range]] = {}
        for item in (self._zero, self._cut, *self._curves.values()):
            self._view.addItem(item, ignoreBounds=True)
        self._flags = [PeakFlag(number, EXACT) for number in (1, 2, 3)]
        for number, flag in enumerate(self._flags):
            flag.clicked.connect(lambda n=number: self.peakClicked.emit(n))
            flag.hide()
            area.opacity.addItem(flag, ignoreBounds=True)
        viewport = area.widget.viewport()
        viewport.setMouseTracking(True)
        viewport.installEventFilter(self)
        area.axisChanged.connect(self._place_flags)
        area.axisChanged.connect(self._mark_cut)
        area.axisChanged.connect(self._show_band)
        dispatcher.regionAnswered.connect(self.refresh)
        dispatcher.visibilityAnswered.connect(self._show_visibility)
        sensitivity.bandChanged.connect(lambda _band: self._show_band())
        sensitivity.choicesChanged.connect(lambda _choices: self._choices_changed())
        sensitivity.regionsChanged.connect(self._mark_stale)
        state.inputsChanged.connect(self._mark_stale)

    @property
    def is_marked_stale(self) -> bool:
        """Whether the responses shown are known not to be of the present image."""
        return bool(self._curves["exact"].opacity() < 1)

    @property
    def arrows(self) -> list[float]:
        """Scalar values at which arrows say that a curve leaves the plot."""
        return [self._area.axis.value(place) for place in self._cut.getData()[0]]

    @property
    def value_text(self) -> str:
        """The scalar values of the band as they are displayed; empty without one."""
        return self._value.toPlainText() if self._value.isVisible() else ""

    def curve(self, name: str) -> NDArray[np.float64]:
        """Return the responses shown as a curve, "exact" or "learned"; empty if hidden."""
        curve = self._curves[name]
        return np.asarray(curve.yData if curve.isVisible() and curve.yData is not None else [])

    def refresh(self) -> None:
        """Draw the newest responses."""
        choices = self._sensitivity.choices
        answers = {
            name: self._dispatcher.regions.get(source)
            for name, source in (
                ("exact", self._dispatcher.exact_source),
                ("learned", "learned"),
            )
        }
        shown = {name: self._displayed(answer) for name, answer in answers.items()}
        for name, curve in self._curves.items():
            values, of = shown[name], answers[name]
            curve.setVisible(values is not None and choices.shown)
            if values is not None and of is not None:
                # The TF's range may have changed since it was asked.
                self._area.draw(curve, values, of.request.inputs.opacity_tf.scalar_range)
        self._scale_axis([values for values in shown.values() if values is not None])
        self._shown = {
            name: (values, of.request.inputs.opacity_tf.scalar_range)
            for name, values in shown.items()
            if values is not None and (of := answers[name]) is not None and choices.shown
        }
        self._mark_cut()
        self._mark_stale()
        answer = self._dispatcher.region_answer
        values = self._displayed(answer)
        promising: tuple[Interval, ...] = ()
        if values is not None and answer is not None and choices.shown:
            scalar_range = answer.request.inputs.opacity_tf.scalar_range
            self.is_flat = bool(np.abs(values).max() < FLOOR * SMALL_EDIT)
            inside = np.abs(self._inside(values))
            at = float(np.linspace(*scalar_range, TF_SAMPLES)[int(inside.argmax())])
            self.strongest = None if self.is_flat else at
            promising = promising_intervals(values, scalar_range, CANDIDATES, window=self._interest)
        if promising != self.promising:
            self.promising = promising
            self.rank(promising)
            self.intervalsChanged.emit(promising)
        self._axis.setVisible(choices.shown)

    def rank(self, intervals: Sequence[Interval]) -> None:
        """Put flags at the best of the intervals.

        Parameters
        ----------
        intervals : sequence of Interval
            The promising ones, the best one first.
        """
        self.intervals = tuple(intervals[: len(self._flags)])
        self._place_flags()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the mouse over the opacity plot; the handles get their events as always."""
        kind = event.type()
        if not self._sensitivity.choices.shown:
            return False
        if kind == QEvent.Type.Leave:
            self._edits = False
            self._sensitivity.hover(None)
        elif kind == QEvent.Type.Wheel:
            wheel = cast(QWheelEvent, event)
            position = wheel.position()
            # With Ctrl, the wheel zooms the plots' axis.
            zooms = bool(wheel.modifiers() & Qt.KeyboardModifier.ControlModifier)
            if not zooms and self._value_at(position) is not None:
                self._sensitivity.widen(wheel.angleDelta().y() / 120)
                return True
        elif kind == QEvent.Type.MouseButtonPress:
            mouse = cast(QMouseEvent, event)
            left = mouse.button() == Qt.MouseButton.LeftButton
            # With Shift, a drag selects handles.
            plain = left and not mouse.modifiers() & Qt.KeyboardModifier.ShiftModifier
            self._edits = self._handle_at(mouse.position(), DragHandle)
            free = plain and not self._handle_at(mouse.position(), DragHandle | PeakFlag)
            self._pressed = mouse.position() if free else None
            if self._edits:
                self._sensitivity.hover(None)
        elif kind == QEvent.Type.MouseMove:
            self._move(cast(QMouseEvent, event))
        elif kind == QEvent.Type.MouseButtonRelease:
            if self._sensitivity.dragging and self._pressed is not None:
                self._sensitivity.finish_band()
            elif self._pressed is not None:
                # A click beside the handles.
                self._sensitivity.unpin()
                self._sensitivity.hover(
                    self._value_at(self._pressed), _asks_effect(cast(QMouseEvent, event))
                )
            self._pressed = None
        return False

    def _move(self, event: QMouseEvent) -> None:
        value = self._value_at(event.position())
        if not event.buttons():
            # Who has just moved a handle looks at the picture.
            self._sensitivity.hover(None if self._edits else value, _asks_effect(event))
        elif self._pressed is not None:
            start = self._value_at(self._pressed)
            moved = abs(event.position().x() - self._pressed.x()) > CLICK_REACH
            if start is not None and value is not None and moved:
                self._sensitivity.drag_band(start, value, _asks_effect(event))

    def _value_at(self, position: QPointF) -> float | None:
        """Scalar value under the mouse; None beside the opacity plot."""
        at = self._area.widget.mapToScene(position.toPoint())
        if not self._area.opacity.sceneBoundingRect().contains(at):
            return None
        place = self._area.opacity.mapSceneToView(at).x()
        lo, hi = self._state.scalar_range
        return min(max(self._area.axis.value(min(max(place, 0.0), 1.0)), lo), hi)

    def _handle_at(self, position: QPointF, kinds: Any) -> bool:
        items = self._area.widget.items(position.toPoint())
        return any(isinstance(item, kinds) and item.isVisible() for item in items)

    def _displayed(self, answer: RegionAnswer | None) -> NDArray[np.float64] | None:
        """Responses in the displayed unit; None for those of another measure."""
        if answer is None or answer.request.measure != self._sensitivity.choices.measure:
            return None
        return displayed(answer)

    @property
    def _interest(self) -> Range:
        """The values of interest, and all above: it is below them that the background lies."""
        return self._dispatcher.window[0], self._state.scalar_range[1]

    def _inside(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Responses of the values of interest; those of the background may be 100 times as high."""
        scalars = np.linspace(*self._state.scalar_range, TF_SAMPLES)
        lo, hi = self._interest
        return np.where((scalars >= lo) & (scalars <= hi), values, 0.0)

    def _scale_axis(self, curves: list[NDArray[np.float64]]) -> None:
        highest = max((float(np.abs(self._inside(v)).max()) for v in curves), default=0.0)
        limit = max(1.15 * highest, FLOOR)
        choices = self._sensitivity.choices
        if choices.locked and self._limit > FLOOR:
            limit = self._limit
        elif self._sensitivity.dragging or self._state.live:
            # Growing only: a scale that shrinks while dragging hides that the response falls.
            limit = max(limit, self._limit)
        self._limit = limit
        signed = choices.measure == "signed"
        self._view.setYRange(-limit if signed else -0.02 * limit, limit, padding=0)
        self._axis.setLabel("Change per +.01")
        what = "brighter (above 0) or darker" if signed else "size of the change"
        self._axis.setToolTip(
            "Change of the region's pixel values (0 to 1) by an edit that adds .01 of opacity "
            f"where it is highest: {what}. An arrow at the edge: the curve goes on beyond."
        )

    def _mark_cut(self) -> None:
        """Put an arrow where a curve leaves the plot: once for each part outside."""
        spots = []
        for name, (values, (low, high)) in self._shown.items():
            places = self._area.axis.places(np.linspace(low, high, len(values)))
            beyond = (np.abs(values) > self._limit) & (places >= 0) & (places <= 1)
            starts = np.flatnonzero(np.diff(np.concatenate([[0], beyond, [0]])))
            for first, end in starts.reshape(-1, 2):
                at = first + int(np.argmax(np.abs(values[first:end])))
                up = values[at] > 0
                spots.append(
                    {
                        "pos": (places[at], (0.94 if up else -0.94) * self._limit),
                        "symbol": "t1" if up else "t",
                        "brush": EXACT if name == "exact" else LEARNED,
                    }
                )
        self._cut.setData(spots)

    def _mark_stale(self) -> None:
        """Dim the curves that are not of the present image."""
        for name, source in (("exact", self._dispatcher.exact_source), ("learned", "learned")):
            fresh = self._dispatcher.is_fresh(self._dispatcher.regions.get(source))
            self._curves[name].setOpacity(1.0 if fresh else 0.35)

    def _choices_changed(self) -> None:
        shown = self._sensitivity.choices.shown
        if not shown:
            self._pressed = None
        self._show_visibility()
        self._show_band()
        self.refresh()

    def _place_flags(self) -> None:
        for flag, interval in zip(self._flags, self.intervals, strict=False):
            flag.setPos(self._area.axis.place(interval.value), 1.05)
        for number, flag in enumerate(self._flags):
            here = number < len(self.intervals)
            flag.setVisible(here and 0 <= self._area.axis.place(self.intervals[number].value) <= 1)
            if number < len(self.intervals):
                flag.setToolTip("Click to add a mode here")

    def _show_band(self) -> None:
        band, choices = self._sensitivity.band, self._sensitivity.choices
        for item in (self._band, self._value):
            item.setVisible(band is not None and choices.shown)
        if band is not None:
            places = [self._area.axis.place(value) for value in band.values]
            one, other = (
                value_text(v, self._state.scalar_range, self._state.scale) for v in band.values
            )
            text = one if one == other else f"{one} to {other}"
            self._value.setText(f"edit at {text}" if band.effect else text)
            self._band.setBrush(_brush(BAND if band.effect else VISIBLE, 110))
            # Beside the band, where there is room.
            right = places[1] < 0.75
            self._value.setAnchor((-0.15, 0.0) if right else (1.15, 0.0))
            self._value.setPos(places[1 if right else 0], 1.0)
            edit = edit_over(band.values, self._state.scalar_range, choices.width)
            heights = BAND_HEIGHT * edit / edit.max()
            self._area.draw(self._band, heights, self._state.scalar_range)

    def _show_visibility(self) -> None:
        answer = self._dispatcher.visibility
        shown = answer is not None and self._sensitivity.choices.shown
        self._visible.setVisible(shown)
        self._visible_region.setVisible(shown and self._sensitivity.active is not None)
        if answer is None:
            return
        region, whole = answer.value.astype(np.float64)
        # As shares of all that is visible there, so that region and image can be compared.
        parts = [part / max(float(part.sum()), 1e-9) for part in (region, whole)]
        top = max(float(part.max()) for part in parts)
        for part, item in zip(parts, (self._visible_region, self._visible), strict=True):
            heights = VISIBLE_HEIGHT * part / max(top, 1e-9)
            self._area.draw(item, heights, answer.request.inputs.opacity_tf.scalar_range)


def _asks_effect(event: QMouseEvent) -> bool:
    """Whether the mouse asks what an edit would change, instead of where values are visible."""
    return bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)


def _filled(color: str, alpha: int) -> Any:
    return pg.PlotCurveItem(pen=None, fillLevel=0, brush=_brush(color, alpha))


def _brush(color: str, alpha: int) -> QColor:
    brush = QColor(color)
    brush.setAlpha(alpha)
    return brush
