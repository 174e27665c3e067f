"""The transfer-function editor: plots, number fields and keyboard shortcuts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app.state.viewer_state import ViewerState
from app.tf_editor.color_layer import ColorLayer
from app.tf_editor.numbers import NumbersPanel
from app.tf_editor.opacity_layer import OpacityLayer, handle_name
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.popup import pop_up
from app.tf_editor.selection import Selection
from model.scene import tf_editing as edits
from model.scene.transfer_function import Range

_NUDGE_HEIGHT = 0.01
_BIG_NUDGE = 10
"""Number of small steps of an arrow key with Shift."""

_HINT = "Double-click adds a mode   ·   click the strip adds a colour   ·   Delete removes"


class TransferFunctionEditor(QFrame):
    """Edits a state's TF over a volume's histogram.

    Parameters
    ----------
    state : ViewerState
    """

    def __init__(self, state: ViewerState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "panel")
        self._state = state
        self.selection = Selection(self)
        # Connected first, so that no other slot finds a selected handle that no longer exists.
        state.transferFunctionChanged.connect(self.selection.fit)
        self.area = PlotArea(self)
        self.opacity = OpacityLayer(self.area, state, self.selection)
        self.color = ColorLayer(self.area, state, self.selection)
        self.numbers = NumbersPanel(state, self.selection, self)
        self._lay_out()
        self._connect()
        self.setEnabled(False)

    def set_data(
        self,
        counts: NDArray[np.int64],
        edges: NDArray[np.float64],
        data_range: Range,
        units: str,
    ) -> None:
        """Show a volume's histogram and allow editing.

        Parameters
        ----------
        counts : ndarray of int64, shape (bins,)
            Number of voxels in each bin.
        edges : ndarray of float64, shape (bins + 1,)
            Increasing, evenly spaced or not, in the data's own units.
        data_range : tuple of float
            Smallest and largest voxel; the TF's range may be wider or narrower.
        units : str
            Unit of the scalars; may be empty.
        """
        self.area.set_data(counts, edges, data_range, units)
        self.setEnabled(True)

    def select_strongest(self) -> None:
        """Select the most opaque mode or point."""
        handles = edits.opacity_handles(self._state.transfer_function.opacity)
        if handles:
            self.selection.select("opacity", max(range(len(handles)), key=lambda i: handles[i][1]))

    def _lay_out(self) -> None:
        title = QLabel("Transfer function")
        title.setProperty("role", "title")
        title.setToolTip(_HINT)
        self._header = QHBoxLayout()
        self._header.setSpacing(14)
        self._header.addWidget(title)
        plots = QVBoxLayout()
        plots.setSpacing(6)
        plots.addLayout(self._header)
        plots.addWidget(self.area.widget, 1)
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(14, 10, 14, 10)
        self._row.setSpacing(18)
        self._row.addLayout(plots, 1)
        self._row.addWidget(self.numbers)

    def add_to_header(self, widget: QWidget) -> None:
        """Add controls beside the title."""
        self._header.addWidget(widget, 1)

    def add_beside(self, widget: QWidget) -> None:
        """Add a panel between the plots and the numbers."""
        self._row.insertWidget(1, widget)

    def _connect(self) -> None:
        self.area.opacityClicked.connect(self.selection.clear)
        self.area.opacityDoubleClicked.connect(self.opacity.add)
        self.area.opacityMenuRequested.connect(self._opacity_menu)
        self.area.stripClicked.connect(self.color.add)
        self.numbers.addRequested.connect(self._add_in_the_middle)
        self.numbers.removeRequested.connect(self.remove_selected)
        self.numbers.colorRequested.connect(self._choose_selected_color)
        self._shortcut(QKeySequence(Qt.Key.Key_Delete), self.remove_selected)
        self._shortcut(QKeySequence(Qt.Key.Key_Backspace), self.remove_selected)
        for key, right, up in (
            (Qt.Key.Key_Left, -1, 0),
            (Qt.Key.Key_Right, 1, 0),
            (Qt.Key.Key_Up, 0, 1),
            (Qt.Key.Key_Down, 0, -1),
        ):
            self._shortcut(QKeySequence(key), lambda r=right, u=up: self.nudge(r, u))
            self._shortcut(
                QKeySequence(Qt.Modifier.SHIFT | key),
                lambda r=right, u=up: self.nudge(_BIG_NUDGE * r, _BIG_NUDGE * u),
            )

    def _shortcut(self, keys: QKeySequence, slot: object) -> None:
        """Bind keys that are active only while the plots have the focus."""
        shortcut = QShortcut(keys, self.area.widget)
        shortcut.setContext(Qt.ShortcutContext.WidgetShortcut)
        shortcut.activated.connect(slot)

    def remove_selected(self) -> None:
        """Remove the selected mode, point or colour stop."""
        selected = self.selection.selected
        if selected is not None:
            layer = self.opacity if selected.kind == "opacity" else self.color
            layer.remove(selected.index)

    def nudge(self, right: int, up: int) -> None:
        """Move the selected handle by bins of the scalar range and hundredths of opacity."""
        selected = self.selection.selected
        if selected is None:
            return
        tf = self._state.transfer_function
        shift = right * tf.opacity.bin_width
        if selected.kind == "opacity":
            value, height = edits.opacity_handles(tf.opacity)[selected.index]
            opacity = edits.move_opacity_handle(
                tf.opacity, selected.index, value + shift, height + up * _NUDGE_HEIGHT
            )
            tf = replace(tf, opacity=opacity)
        else:
            value = tf.color.stops[selected.index][0]
            tf = replace(tf, color=edits.move_stop(tf.color, selected.index, value + shift))
        self._state.commit(tf, "nudge", f"nudge {selected.kind} {selected.index}")

    def _add_in_the_middle(self) -> None:
        lo, hi = self._state.scalar_range
        self.opacity.add((lo + hi) / 2, 0.3)

    def _choose_selected_color(self) -> None:
        index = self.selection.index("color")
        if index is not None:
            self.color.choose_color(index)

    def _opacity_menu(self, value: float, height: float, point: QPoint) -> None:
        text = f"Add {handle_name(self._state.transfer_function.opacity)} here"
        pop_up(self.area.widget, point, (text, lambda: self.opacity.add(value, height), True))
