"""The colour strip of the TF editor, with draggable stops."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QObject, QPoint
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QColorDialog

from app.state.viewer_state import ViewerState
from app.tf_editor.handle import DragHandle
from app.tf_editor.moves import HandleMoves
from app.tf_editor.plot_area import PINS_HEIGHT, STRIP_HEIGHT, PlotArea
from app.tf_editor.popup import pop_up
from app.tf_editor.selection import Selection
from model.scene import tf_editing as edits
from model.scene.transfer_function import ColorTF
from model.scene.value_text import value_text

_PIXELS = 1024

PIN_PLACE = -0.5 * PINS_HEIGHT / STRIP_HEIGHT
"""Where pins stand, in heights of the strip from its lower edge."""


class ColorLayer(QObject):
    """Draws the state's colour TF and edits it by drags and clicks."""

    def __init__(
        self, area: PlotArea, state: ViewerState, selection: Selection, moves: HandleMoves
    ) -> None:
        super().__init__(area)
        view = area.strip
        self._area = area
        self._view = view
        self._state = state
        self._selection = selection
        self._moves = moves
        self._strip: Any = pg.ImageItem(axisOrder="row-major")
        view.addItem(self._strip, ignoreBounds=True)
        self._stops: list[DragHandle] = []
        state.tf_input.changed.connect(state.calm.soon(self.refresh))
        selection.changed.connect(self.refresh)
        area.axisChanged.connect(self.refresh)

    @property
    def stops(self) -> tuple[DragHandle, ...]:
        """Handles of the stops, in order."""
        return tuple(self._stops)

    def refresh(self) -> None:
        """Redraw the state's colour TF."""
        color = self._state.transfer_function.color
        # Values beyond the TF's range look like its ends.
        values = self._area.axis.values(np.linspace(0.0, 1.0, _PIXELS)).clip(*color.scalar_range)
        levels = np.rint(color(values) * 255).astype(np.uint8)
        self._strip.setImage(levels[np.newaxis], levels=(0, 255))
        self._strip.setRect(0.0, 0.0, 1.0, 1.0)
        while len(self._stops) < len(color.stops):
            self._stops.append(self._add_handle(len(self._stops)))
        while len(self._stops) > len(color.stops):
            self._view.removeItem(self._stops.pop())
        selected = self._selection.indices("color")
        for index, (value, *rgb) in enumerate(color.stops):
            place = self._area.axis.place(value)
            self._stops[index].setPos(place, PIN_PLACE)
            self._stops[index].setVisible(0.0 <= place <= 1.0)
            self._stops[index].set_look(QColor.fromRgbF(*rgb), index in selected)

    def add(self, value: float) -> None:
        """Add a stop and select it."""
        color, index = edits.add_stop(self._state.transfer_function.color, value)
        self._commit(color, "add colour stop")
        self._selection.select("color", index)

    def remove(self, index: int) -> None:
        """Remove a stop, unless it is at an end."""
        color = self._state.transfer_function.color
        if not edits.is_end_stop(color, index):
            self._selection.clear()
            self._commit(edits.remove_stop(color, index), "remove colour stop")

    def choose_color(self, index: int) -> QColorDialog:
        """Open the colour dialog for a stop, with a preview in the images."""
        return self._choose(self._state.transfer_function.color, index)

    def choose_color_at(self, value: float) -> QColorDialog:
        """Open the colour dialog for the stop at a value, or for one that is added there."""
        tf = self._state.transfer_function
        near = tf.opacity.bin_width / 2
        for index, stop in enumerate(tf.color.stops):
            if abs(stop[0] - value) <= near:
                return self._choose(tf.color, index)
        return self._choose(*edits.add_stop(tf.color, value))

    def _choose(self, before: ColorTF, index: int) -> QColorDialog:
        _value, *rgb = before.stops[index]
        dialog = QColorDialog(QColor.fromRgbF(*rgb), self._area.widget)
        dialog.setWindowTitle("Colour of the stop")
        dialog.currentColorChanged.connect(partial(self._preview_color, before, index))
        dialog.accepted.connect(lambda: self._state.tf_input.finish("colour"))
        dialog.rejected.connect(self._state.tf_input.cancel)
        # The stop belongs to the present volume's TF.
        self._state.volumeStarting.connect(dialog.reject)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()
        return dialog

    def _preview_color(self, before: ColorTF, index: int, color: QColor) -> None:
        tf = self._state.transfer_function
        rgb = color.redF(), color.greenF(), color.blueF()
        self._state.tf_input.move(replace(tf, color=edits.recolor_stop(before, index, rgb)))

    def _commit(self, color: ColorTF, text: str) -> None:
        tf = self._state.transfer_function
        self._state.tf_input.set(replace(tf, color=color), text)

    def _add_handle(self, index: int) -> DragHandle:
        handle = DragHandle("pin")
        handle.pressed.connect(lambda: self._moves.press("color", index, adds=handle.adds))
        handle.dragged.connect(lambda x, _y: self._drag(index, x))
        handle.released.connect(self._finish_drag)
        handle.doubleClicked.connect(lambda: self.choose_color(index))
        handle.menuRequested.connect(lambda point: self._menu(index, point))
        self._view.addItem(handle, ignoreBounds=True)
        return handle

    def _drag(self, index: int, place: float) -> None:
        self._moves.drag("color", index, self._area.axis.value(place))
        x = self._state.transfer_function.color.stops[index][0]
        text = f"value {value_text(x, self._state.scalar_range, self._state.scale)}"
        self._area.show_readout(self._view, x, 0.5, text)

    def _finish_drag(self) -> None:
        self._area.readout.hide()
        self._moves.finish("drag colour stop")

    def _menu(self, index: int, point: QPoint) -> None:
        removable = not edits.is_end_stop(self._state.transfer_function.color, index)
        pop_up(
            self._area.widget,
            point,
            ("Choose colour…", lambda: self.choose_color(index), True),
            ("Remove stop", lambda: self.remove(index), removable),
        )
