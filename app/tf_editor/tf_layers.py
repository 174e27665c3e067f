"""The TF in the plots: opacity curve and colour strip, with draggable handles."""

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QObject, QPoint, QPointF, Qt
from PySide6.QtGui import QBrush, QColor, QLinearGradient
from PySide6.QtWidgets import QColorDialog

from app import theme
from app.number_box import short, significant
from app.tf_editor.handles import DragHandle, HandleMoves, handle_name
from app.tf_editor.histogram import Curve
from app.tf_editor.plot_area import PIN_PLACE, PlotArea
from app.tf_editor.unit_axis import WIDTHS, ScalarAxis
from model.scene import tf_editing as edits
from model.scene.transfer_function import ColorTF, TransferFunction

_FLANK = math.exp(-1.0)  # height of a mode one width from its mean, relative to its amplitude

_VISIBLE_WIDTHS, _VISIBLE_LOG_WIDTHS = 2.2, 3.2
"""Distance from the mean, in widths, up to which a mode's curve is drawn, by scale."""

_PLACES = np.linspace(0.0, 1.0, 513)


class OpacityLayer(QObject):
    """Draws the state's opacity TF and edits it by drags."""

    def __init__(self, area: PlotArea, moves: HandleMoves) -> None:
        super().__init__(area)
        self._area, self._moves = area, moves
        self._state, self._selection = moves.state, moves.selection
        self._fill = Curve(area.back)
        self._filled: object = None
        self._curve, self._selected_curve = Curve(area.opacity), Curve(area.opacity)
        self.peaks: list[DragHandle] = []  # handles of the modes or points, in order
        self.flanks = tuple(self._add_flank() for _ in range(2))
        """Left and right handle for the selected mode's width."""
        self.recolor()

    @property
    def handles(self) -> list[DragHandle]:
        """All handles."""
        return [*self.peaks, *self.flanks]

    def refresh(self) -> None:
        """Redraw the state's TF."""
        tf = self._moves.tf
        # Values beyond the TF's range look like its ends.
        self._values = self._area.axis.values(_PLACES).clip(*tf.scalar_range)
        heights = self._area.scale.heights(tf.opacity(self._values))
        self._curve.draw(_PLACES, heights)
        self._fill.draw(_PLACES, heights)
        if self._filled != (tf.color, self._area.axis):
            self._filled = tf.color, self._area.axis
            self._fill.brush = _gradient(tf, self._area.axis)
        self._place_peaks(tf)
        self._place_flanks(tf)

    def _place_peaks(self, tf: TransferFunction) -> None:
        positions = edits.opacity_handles(tf.opacity)
        while len(self.peaks) < len(positions):
            self.peaks.append(self._add_peak(len(self.peaks)))
        while len(self.peaks) > len(positions):
            self._area.opacity.removeItem(self.peaks.pop())
        selected = self._selection.indices("opacity")
        colors = tf.color(np.array([value for value, _ in positions])).tolist()
        for index, (value, opacity) in enumerate(positions):
            handle = self.peaks[index]
            # A mode's mean may be outside the range; its handle is then at the range's end.
            place = self._area.axis.place(min(max(value, tf.scalar_range[0]), tf.scalar_range[1]))
            handle.setPos(place, self._area.scale.height(opacity))
            handle.setToolTip(self._state.label_name(value))
            handle.setVisible(0.0 <= place <= 1.0)
            handle.set_look(QColor.fromRgbF(*colors[index]), index in selected)

    def _place_flanks(self, tf: TransferFunction) -> None:
        index = self._selection.index("opacity")
        shown = index is not None and not tf.opacity.points
        for item in (*self.flanks, self._selected_curve):
            item.setVisible(shown)
        if index is None or not shown:
            return
        mode = tf.opacity.modes[index]
        axis, scale = self._area.axis, self._area.scale
        heights = scale.heights(replace(tf.opacity, modes=(mode,))(self._values))
        widths = _VISIBLE_LOG_WIDTHS if scale.logarithmic else _VISIBLE_WIDTHS
        ends = [axis.place(mode.mean + side * widths * mode.width) for side in (-1, 1)]
        nearby = slice(*np.searchsorted(_PLACES, ends))
        self._selected_curve.draw(_PLACES[nearby], heights[nearby])
        for number, (handle, side) in enumerate(zip(self.flanks, (-1, 1), strict=True)):
            value = mode.mean + side * mode.width
            place = axis.place(value)
            handle.setPos(place, scale.height(mode.amplitude * _FLANK))
            inside = tf.scalar_range[0] <= value <= tf.scalar_range[1]
            handle.setVisible(inside and 0.0 <= place <= 1.0)
            handle.set_look(QColor(theme.CURVE), True, ringed=self._selection.flank == number)

    def recolor(self) -> None:
        """Take the colours of the theme in use."""
        self._curve.pen = pg.mkPen(theme.CURVE, width=1.6)
        self._selected_curve.pen = pg.mkPen(theme.DIM, style=Qt.PenStyle.DashLine)
        self.refresh()

    def _add_peak(self, index: int) -> DragHandle:
        handle = DragHandle(
            "circle",
            partial(self._drag_peak, index),
            self._finish_drag,
            partial(self._moves.press, "opacity", index),
            partial(self._peak_menu, index),
        )
        self._area.opacity.addItem(handle, ignoreBounds=True)
        return handle

    def _add_flank(self) -> DragHandle:
        handle = DragHandle("square", lambda x, _y: self._drag_flank(x), self._finish_drag)
        handle.setCursor(Qt.CursorShape.SizeHorCursor)
        handle.hide()
        self._area.opacity.addItem(handle, ignoreBounds=True)
        return handle

    def _drag_peak(self, index: int, place: float, height: float) -> None:
        area = self._area
        self._moves.drag("opacity", index, area.axis.value(place), area.scale.opacity(height))
        x, y = edits.opacity_handles(self._moves.tf.opacity)[index]
        self._say(x, y, f"value {self._state.value_text(x)}   opacity {short(y)}")

    def _drag_flank(self, place: float) -> None:
        index, tf = self._selection.index("opacity"), self._moves.tf
        if index is None or tf.opacity.points:
            return
        width = abs(self._area.axis.value(place) - tf.opacity.modes[index].mean)
        opacity = edits.resize_mode(tf.opacity, index, width)
        self._state.tf_input.move(replace(tf, opacity=opacity))
        mode = opacity.modes[index]
        text = f"{WIDTHS[self._state.scale]} {significant(mode.width, 3)}"
        self._say(mode.mean, mode.amplitude, text)

    def _say(self, value: float, opacity: float, text: str) -> None:
        area = self._area
        height = area.scale.height(opacity)
        show = partial(area.show_readout, area.opacity, value, height, text)
        self._state.refreshes.ask(area.show_readout, show)

    def _finish_drag(self) -> None:
        self._moves.finish(f"drag {handle_name(self._moves.tf.opacity)}")
        self._area.hide_readout()

    def _peak_menu(self, index: int, point: QPoint) -> None:
        opacity = self._moves.tf.opacity
        removable = edits.can_remove_opacity_handle(opacity, index)
        remove = partial(self._moves.remove_at, "opacity", index)
        self._area.pop_up(point, (f"Remove {handle_name(opacity)}", remove, removable))


def _gradient(tf: TransferFunction, axis: ScalarAxis) -> QBrush:
    """Brush for the area under the curve, with the colour TF along the scalar axis."""
    gradient = QLinearGradient(QPointF(0.0, 0.0), QPointF(1.0, 0.0))
    places = axis.places([stop[0] for stop in tf.color.stops])
    inside = places[(places > 0) & (places < 1)]
    shown = np.concatenate([[0.0], inside, [1.0]])
    for place, (red, green, blue) in zip(shown, tf.color(axis.values(shown)), strict=True):
        gradient.setColorAt(float(place), QColor.fromRgbF(red, green, blue, 0.55))
    return QBrush(gradient)


_PIXELS = 1024


class ColorLayer(QObject):
    """Draws the state's colour TF and edits it by drags and clicks."""

    def __init__(self, area: PlotArea, moves: HandleMoves) -> None:
        super().__init__(area)
        self._area, self._moves = area, moves
        self._state, self._selection = moves.state, moves.selection
        self._shown: object = None
        self._strip: Any = pg.ImageItem(axisOrder="row-major")
        area.strip.addItem(self._strip, ignoreBounds=True)
        self.stops: list[DragHandle] = []  # handles of the stops, in order

    def refresh(self) -> None:
        """Redraw the state's colour TF."""
        color = self._moves.tf.color
        if self._shown != (color, self._area.axis):
            self._shown = color, self._area.axis
            # Values beyond the TF's range look like its ends.
            places = np.linspace(0.0, 1.0, _PIXELS)
            values = self._area.axis.values(places).clip(*color.scalar_range)
            levels = np.rint(color(values) * 255).astype(np.uint8)
            self._strip.setImage(levels[np.newaxis], levels=(0, 255))
            self._strip.setRect(0.0, 0.0, 1.0, 1.0)
        while len(self.stops) < len(color.stops):
            self.stops.append(self._add_handle(len(self.stops)))
        while len(self.stops) > len(color.stops):
            self._area.strip.removeItem(self.stops.pop())
        selected = self._selection.indices("color")
        for index, (value, *rgb) in enumerate(color.stops):
            place = self._area.axis.place(value)
            self.stops[index].setPos(place, PIN_PLACE)
            self.stops[index].setVisible(0.0 <= place <= 1.0)
            self.stops[index].set_look(QColor.fromRgbF(*rgb), index in selected)

    def choose_color(self, index: int) -> QColorDialog:
        """Open the colour dialog for a stop, with a preview in the images."""
        return self._choose(self._moves.tf.color, index)

    def choose_selected(self) -> None:
        """Open the colour dialog for the selected stop, or for the value of a mode or point."""
        tf, handle = self._moves.tf, self._selection.index("opacity")
        stop = self._selection.index("color")
        if handle is not None:
            value = edits.opacity_handles(tf.opacity)[handle][0]
            reach = tf.opacity.bin_width / 2
            near = [i for i, each in enumerate(tf.color.stops) if abs(each[0] - value) <= reach]
            self._choose(*((tf.color, near[0]) if near else edits.add_stop(tf.color, value)))
        elif stop is not None:
            self.choose_color(stop)

    def _choose(self, before: ColorTF, index: int) -> QColorDialog:
        _value, *rgb = before.stops[index]
        dialog = QColorDialog(QColor.fromRgbF(*rgb), self._area.widget)
        dialog.setWindowTitle("Colour of the stop")
        dialog.currentColorChanged.connect(partial(self._preview_color, before, index))
        dialog.accepted.connect(lambda: self._state.tf_input.finish("colour"))
        dialog.rejected.connect(self._state.tf_input.cancel)
        # The stop belongs to the present volume's TF.
        self._state.volumeStarting.connect(dialog.reject)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()
        return dialog

    def _preview_color(self, before: ColorTF, index: int, color: QColor) -> None:
        rgb = color.redF(), color.greenF(), color.blueF()
        after = edits.recolor_stop(before, index, rgb)
        self._state.tf_input.move(replace(self._moves.tf, color=after))

    def _add_handle(self, index: int) -> DragHandle:
        handle = DragHandle(
            "pin",
            lambda x, _y: self._drag(index, x),
            self._finish_drag,
            partial(self._moves.press, "color", index),
            partial(self._menu, index),
            lambda: self.choose_color(index),
        )
        self._area.strip.addItem(handle, ignoreBounds=True)
        return handle

    def _drag(self, index: int, place: float) -> None:
        self._moves.drag("color", index, self._area.axis.value(place))
        x = self._moves.tf.color.stops[index][0]
        self._area.show_readout(self._area.strip, x, 0.5, f"value {self._state.value_text(x)}")

    def _finish_drag(self) -> None:
        self._area.hide_readout()
        self._moves.finish("drag colour stop")

    def _menu(self, index: int, point: QPoint) -> None:
        removable = not edits.is_end_stop(self._moves.tf.color, index)
        remove = partial(self._moves.remove_at, "color", index)
        self._area.pop_up(
            point,
            ("Choose colour…", lambda: self.choose_color(index), True),
            ("Remove stop", remove, removable),
        )
