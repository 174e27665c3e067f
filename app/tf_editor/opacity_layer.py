"""The opacity plot of the TF editor: curves, and handles for peaks and widths."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QPoint, QPointF, Qt
from PySide6.QtGui import QBrush, QColor, QLinearGradient, QPainterPath, QPen
from PySide6.QtWidgets import QGraphicsPathItem

from app import theme
from app.short_numbers import significant
from app.state.viewer_state import ViewerState
from app.tf_editor.handle import DragHandle
from app.tf_editor.mode_card import WIDTHS
from app.tf_editor.moves import HandleMoves, handle_name
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.popup import pop_up
from app.tf_editor.selection import Selection
from app.tf_editor.unit_axis import ScalarAxis
from model.scene import tf_editing as edits
from model.scene.transfer_function import OpacityTF, TransferFunction
from model.scene.value_text import value_text

_FLANK = math.exp(-1.0)
"""Height of a mode one width away from its mean, as a fraction of its amplitude."""

_VISIBLE_WIDTHS, _VISIBLE_LOG_WIDTHS = 2.2, 3.2
"""Distances from the mean, in widths, up to which a mode's curve is drawn on either scale."""

_CURVE_SAMPLES = 513
_PLACES = np.linspace(0.0, 1.0, _CURVE_SAMPLES)


class OpacityLayer(QObject):
    """Draws the state's opacity TF and edits it by drags."""

    def __init__(
        self, area: PlotArea, state: ViewerState, selection: Selection, moves: HandleMoves
    ) -> None:
        super().__init__(area)
        view = area.opacity
        self._area = area
        self._view = view
        self._state = state
        self._selection = selection
        self._moves = moves
        self._fill = QGraphicsPathItem()
        self._fill.setPen(QPen(Qt.PenStyle.NoPen))
        area.back.addItem(self._fill, ignoreBounds=True)
        self._curve = self._add_curve()
        self._selected_curve = self._add_curve()
        self._peaks: list[DragHandle] = []
        self._flanks = [self._add_flank() for _ in range(2)]
        state.tf_input.changed.connect(state.calm.soon(self.refresh))
        selection.changed.connect(self.refresh)
        area.axisChanged.connect(self.refresh)
        area.recolored.connect(self._recolor)
        self._recolor()

    @property
    def peaks(self) -> tuple[DragHandle, ...]:
        """Handles of the modes or points, in order."""
        return tuple(self._peaks)

    @property
    def flanks(self) -> tuple[DragHandle, ...]:
        """Left and right handle of the selected mode's width."""
        return tuple(self._flanks)

    def refresh(self) -> None:
        """Redraw the state's TF."""
        tf = self._state.transfer_function
        # Values beyond the TF's range look like its ends.
        self._values = self._area.axis.values(_PLACES).clip(*tf.scalar_range)
        heights = self._area.scale.heights(tf.opacity(self._values))
        self._curve.setData(_PLACES, heights)
        self._fill.setPath(_area_below(heights))
        self._fill.setBrush(_gradient(tf, self._area.axis))
        self._place_peaks(tf)
        self._place_flanks(tf)

    def add(self, value: float, height: float) -> None:
        """Add a mode or point and select it."""
        opacity, index = edits.add_opacity_handle(
            self._state.transfer_function.opacity, value, height
        )
        self._commit(opacity, f"add {handle_name(opacity)}")
        self._selection.select("opacity", index)

    def remove(self, index: int) -> None:
        """Remove a mode or point."""
        opacity = self._state.transfer_function.opacity
        if edits.can_remove_opacity_handle(opacity, index):
            self._selection.clear()
            self._commit(
                edits.remove_opacity_handle(opacity, index), f"remove {handle_name(opacity)}"
            )

    def _commit(self, opacity: OpacityTF, text: str) -> None:
        tf = self._state.transfer_function
        self._state.tf_input.set(replace(tf, opacity=opacity), text)

    def _place_peaks(self, tf: TransferFunction) -> None:
        positions = edits.opacity_handles(tf.opacity)
        while len(self._peaks) < len(positions):
            self._peaks.append(self._add_peak(len(self._peaks)))
        while len(self._peaks) > len(positions):
            self._view.removeItem(self._peaks.pop())
        selected = self._selection.indices("opacity")
        for index, (value, opacity) in enumerate(positions):
            handle = self._peaks[index]
            # The mean of a mode may be outside the range; its handle is at the range's end.
            place = self._area.axis.place(min(max(value, tf.scalar_range[0]), tf.scalar_range[1]))
            handle.setPos(place, self._area.scale.height(opacity))
            handle.setVisible(0.0 <= place <= 1.0)
            handle.set_look(QColor.fromRgbF(*map(float, tf.color(value))), index in selected)

    def _place_flanks(self, tf: TransferFunction) -> None:
        index = self._selection.index("opacity")
        shown = index is not None and not tf.opacity.points
        for handle in self._flanks:
            handle.setVisible(shown)
        self._selected_curve.setVisible(shown)
        if index is None or not shown:
            return
        mode = tf.opacity.modes[index]
        axis = self._area.axis
        heights = self._area.scale.heights(replace(tf.opacity, modes=(mode,))(self._values))
        widths = _VISIBLE_LOG_WIDTHS if self._area.scale.logarithmic else _VISIBLE_WIDTHS
        lo, hi = (axis.place(mode.mean + side * widths * mode.width) for side in (-1, 1))
        nearby = slice(*np.searchsorted(_PLACES, (lo, hi)))
        self._selected_curve.setData(_PLACES[nearby], heights[nearby])
        for number, (handle, side) in enumerate(zip(self._flanks, (-1, 1), strict=True)):
            place = axis.place(mode.mean + side * mode.width)
            handle.setPos(place, self._area.scale.height(mode.amplitude * _FLANK))
            inside = tf.scalar_range[0] <= mode.mean + side * mode.width <= tf.scalar_range[1]
            handle.setVisible(inside and 0.0 <= place <= 1.0)
            handle.set_look(QColor(theme.CURVE), True, ringed=self._selection.flank == number)

    def _recolor(self) -> None:
        self._curve.setPen(pg.mkPen(theme.CURVE, width=1.6))
        dashed = pg.mkPen(theme.DIM_TEXT, width=1.2, style=Qt.PenStyle.DashLine)
        self._selected_curve.setPen(dashed)
        self.refresh()

    def _add_curve(self) -> Any:
        curve = pg.PlotCurveItem(antialias=True)
        self._view.addItem(curve, ignoreBounds=True)
        return curve

    def _add_peak(self, index: int) -> DragHandle:
        handle = DragHandle("circle")
        handle.pressed.connect(lambda: self._moves.press("opacity", index, adds=handle.adds))
        handle.dragged.connect(lambda x, y: self._drag_peak(index, x, y))
        handle.released.connect(self._finish_drag)
        handle.menuRequested.connect(lambda point: self._peak_menu(index, point))
        self._view.addItem(handle, ignoreBounds=True)
        return handle

    def _add_flank(self) -> DragHandle:
        handle = DragHandle("square")
        handle.setCursor(Qt.CursorShape.SizeHorCursor)
        handle.dragged.connect(lambda x, _y: self._drag_flank(x))
        handle.released.connect(self._finish_drag)
        handle.hide()
        self._view.addItem(handle, ignoreBounds=True)
        return handle

    def _drag_peak(self, index: int, place: float, height: float) -> None:
        area = self._area
        self._moves.drag("opacity", index, area.axis.value(place), area.scale.opacity(height))
        x, y = edits.opacity_handles(self._state.transfer_function.opacity)[index]
        value = value_text(x, self._state.scalar_range, self._state.scale)
        text = f"value {value}   opacity {significant(y, 2)}"
        self._say(x, area.scale.height(y), text)

    def _drag_flank(self, place: float) -> None:
        index = self._selection.index("opacity")
        tf = self._state.transfer_function
        if index is None or tf.opacity.points:
            return
        width = abs(self._area.axis.value(place) - tf.opacity.modes[index].mean)
        opacity = edits.resize_mode(tf.opacity, index, width)
        self._state.tf_input.move(replace(tf, opacity=opacity))
        mode = opacity.modes[index]
        height = self._area.scale.height(mode.amplitude)
        self._say(mode.mean, height, f"{WIDTHS[self._state.scale]} {significant(mode.width, 3)}")

    def _say(self, value: float, height: float, text: str) -> None:
        show = partial(self._area.show_readout, self._view, value, height, text)
        self._state.calm.ask(self._area.show_readout, show)

    def _finish_drag(self) -> None:
        self._moves.finish(f"drag {handle_name(self._state.transfer_function.opacity)}")
        self._area.readout.hide()

    def _peak_menu(self, index: int, point: QPoint) -> None:
        opacity = self._state.transfer_function.opacity
        removable = edits.can_remove_opacity_handle(opacity, index)
        text = f"Remove {handle_name(opacity)}"
        pop_up(self._area.widget, point, (text, lambda: self.remove(index), removable))


def _area_below(heights: NDArray[np.float64]) -> QPainterPath:
    """Outline of the area between the curve and the axis."""
    path = QPainterPath(QPointF(0.0, 0.0))
    for place, height in zip(_PLACES, heights, strict=True):
        path.lineTo(place, float(height))
    path.lineTo(1.0, 0.0)
    return path


def _gradient(tf: TransferFunction, axis: ScalarAxis) -> QBrush:
    """Brush for the area under the curve, with the colour TF along the scalar axis."""
    gradient = QLinearGradient(QPointF(0.0, 0.0), QPointF(1.0, 0.0))
    places = axis.places([stop[0] for stop in tf.color.stops])
    inside = places[(places > 0) & (places < 1)]
    shown = np.concatenate([[0.0], inside, [1.0]])
    for place, (red, green, blue) in zip(shown, tf.color(axis.values(shown)), strict=True):
        gradient.setColorAt(float(place), QColor.fromRgbF(red, green, blue, 0.55))
    return QBrush(gradient)
