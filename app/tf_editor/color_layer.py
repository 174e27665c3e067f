"""The colour strip of the TF editor, with draggable stops."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QObject, QPoint, Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QColorDialog

from app.tf_editor.handle import DragHandle
from app.tf_editor.moves import HandleMoves
from app.tf_editor.plot_area import PIN_PLACE, PlotArea
from model.scene import tf_editing as edits
from model.scene.ranges import value_text
from model.scene.transfer_function import ColorTF

_PIXELS = 1024


class ColorLayer(QObject):
    """Draws the state's colour TF and edits it by drags and clicks."""

    def __init__(self, area: PlotArea, moves: HandleMoves) -> None:
        super().__init__(area)
        self._area, self._moves = area, moves
        self._state, self._selection = moves.state, moves.selection
        self._strip: Any = pg.ImageItem(axisOrder="row-major")
        area.strip.addItem(self._strip, ignoreBounds=True)
        self.stops: list[DragHandle] = []
        """Handles of the stops, in order."""

    def refresh(self) -> None:
        """Redraw the state's colour TF."""
        color = self._moves.tf.color
        # Values beyond the TF's range look like its ends.
        values = self._area.axis.values(np.linspace(0.0, 1.0, _PIXELS)).clip(*color.scalar_range)
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
        """Open the colour dialog for the selected stop, or for the value of a mode or point.

        Where that has no stop, it gets one.
        """
        tf, handle = self._moves.tf, self._selection.index("opacity")
        stop = self._selection.index("color")
        if handle is not None:
            value = edits.opacity_handles(tf.opacity)[handle][0]
            near = [
                index
                for index, other in enumerate(tf.color.stops)
                if abs(other[0] - value) <= tf.opacity.bin_width / 2
            ]
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
            lambda: self._moves.press("color", index, adds=handle.adds),
            partial(self._menu, index),
            lambda: self.choose_color(index),
        )
        self._area.strip.addItem(handle, ignoreBounds=True)
        return handle

    def _drag(self, index: int, place: float) -> None:
        self._moves.drag("color", index, self._area.axis.value(place))
        x = self._moves.tf.color.stops[index][0]
        text = f"value {value_text(x, self._state.scalar_range, self._state.scale)}"
        self._area.show_readout(self._area.strip, x, 0.5, text)

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
