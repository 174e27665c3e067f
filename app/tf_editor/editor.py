"""The transfer-function editor: header, plots, the card at the handle, keyboard shortcuts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, QSize, Signal
from PySide6.QtGui import QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QFrame, QHBoxLayout, QVBoxLayout, QWidget

from app.icons import IconButton
from app.state.viewer_state import ViewerState
from app.tf_editor.axis_gestures import AxisGestures
from app.tf_editor.color_layer import ColorLayer
from app.tf_editor.keys import EditorKeys
from app.tf_editor.mode_card import ModeCard
from app.tf_editor.moves import HandleMoves, handle_name
from app.tf_editor.opacity_layer import OpacityLayer
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.popup import pop_up
from app.tf_editor.range_layer import RangeLayer
from app.tf_editor.rubber_band import RubberBand
from app.tf_editor.selection import Selection
from app.tf_editor.tf_menu import TransferFunctionMenu
from model.scene import tf_editing as edits
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import ValueScale

SMALL_RANGE = 0.2
"""Share of all values below which a range is hard to edit while all of them are shown."""

HEADER_HEIGHT = 34

LEAST_WIDTH = 960
LEAST_HEIGHT, GREATEST_HEIGHT = 220, 460
"""Least width, and limits of its height unless it is dragged, in pixels."""

CAPTIONED_FROM = 1180
"""Width from which the card at a handle says what its numbers are, in pixels."""


class TransferFunctionEditor(QFrame):
    """Edits a state's TF over a volume's histogram; the lower third of the window."""

    resized = Signal()

    def __init__(self, state: ViewerState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "panel")
        self._state = state
        self.selection = Selection(self)
        # Connected first, so that no other slot finds a selected handle that no longer exists.
        state.tf_input.changed.connect(self.selection.fit)
        state.tf_input.changed.connect(self._show_new)
        self.area = PlotArea(self)
        self.moves = HandleMoves(state, self.selection, self)
        self.opacity = OpacityLayer(self.area, state, self.selection, self.moves)
        self.color = ColorLayer(self.area, state, self.selection, self.moves)
        self.range = RangeLayer(self.area, state)
        self.gestures = AxisGestures(self.area)
        self.rubber_band = RubberBand(self.area, self.opacity, self.color, self.selection)
        self.keys = EditorKeys(
            self.area, state, self.selection, self.moves, self.opacity, self.color, self.gestures
        )
        self.card = ModeCard(self.area, state, self.selection, self.moves)
        self.menu = TransferFunctionMenu(state, self.area, self.range, self.moves, self)
        self.menu.show_all.connect(self.gestures.show_all)
        self.menu.replaced.connect(self.select_strongest)
        self.menu.range_shown.connect(self.show_range)
        self.add_button = IconButton("plus", "Add mode", "Insert")
        self._is_new = False
        self._range: Range | None = None
        """Scalar range of the last finished edit."""
        self._lay_out()
        self._connect()
        self.setEnabled(False)

    def set_data(
        self,
        counts: NDArray[np.int64],
        edges: NDArray[np.float64],
        data_range: Range,
        units: str,
        scale: ValueScale = "linear",
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
        scale : {"linear", "log"}
            Scale of edges and range.
        """
        self.area.set_data(counts, edges, data_range, units, scale)
        self.menu.presets.units = units
        # The volume's TF follows.
        self._is_new = True
        self.setEnabled(True)

    def set_scale(
        self,
        counts: NDArray[np.int64],
        edges: NDArray[np.float64],
        data_range: Range,
        units: str,
        scale: ValueScale,
    ) -> None:
        """Show the same volume on another scale; see :meth:`set_data`."""
        self.set_data(counts, edges, data_range, units, scale)
        if self._state.scale == scale:
            # No TF follows: this one, of an undone edit, was there before.
            self._show_new()

    def show_range(self, fill: bool = False) -> None:
        """Show all values, or those around the TF's range where it is a small part of them.

        Parameters
        ----------
        fill : bool
            Whether to show those around the range in any case.
        """
        self.area.include(self._state.scalar_range, self._state.scale)
        axis = self.area.axis.showing(self.area.axis.full)
        low, high = axis.places(self._state.scalar_range)
        if fill or high - low < SMALL_RANGE:
            room = (high - low) / 4
            ends = axis.values([max(low - room, 0.0), min(high + room, 1.0)])
            axis = axis.showing((float(ends[0]), float(ends[1])))
        self.area.set_axis(axis)

    def show_small_range(self) -> None:
        """Show the values around the TF's range where it is a small part of those in sight."""
        low, high = self.area.axis.places(self._state.scalar_range)
        if high - low < SMALL_RANGE:
            self.show_range()

    def _follow_range(self, tf: TransferFunction) -> None:
        """Make the values of the TF fit on the axis, and bring a range into sight that is not."""
        self.area.include(tf.scalar_range, tf.scale)
        is_new, self._range = self._range != tf.scalar_range, tf.scalar_range
        # A range that is dragged has an end in sight.
        places = self.area.axis.places(tf.scalar_range)
        if is_new and not np.any((places >= 0.0) & (places <= 1.0)):
            self.show_range()

    def _show_new(self) -> None:
        if self._is_new:
            self._is_new = False
            self.show_range()

    def select_strongest(self) -> None:
        """Select the most opaque mode or point."""
        handles = edits.opacity_handles(self._state.transfer_function.opacity)
        if handles:
            self.selection.select("opacity", max(range(len(handles)), key=lambda i: handles[i][1]))

    def _lay_out(self) -> None:
        header = QWidget()
        header.setFixedHeight(HEADER_HEIGHT)
        self.areas: list[QWidget] = [header, self.area.widget, self.card]
        """Parts that keys go to one after the other."""
        self._header = QHBoxLayout(header)
        self._header.setContentsMargins(8, 0, 8, 0)
        self._header.setSpacing(4)
        menu = self.menu
        self.header_controls: list[QWidget] = [
            menu.presets_button, menu.colors_button, self.add_button, menu.button,
        ]  # fmt: skip
        for button in self.header_controls:
            self._header.addWidget(button)
        self._header.addStretch()
        plots = QVBoxLayout()
        plots.setSpacing(0)
        plots.addWidget(header)
        plots.addWidget(self.area.widget, 1)
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(0, 0, 0, 0)
        self._row.setSpacing(0)
        self._row.addLayout(plots, 1)
        self.setMinimumHeight(LEAST_HEIGHT)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fold what there is no room for."""
        super().resizeEvent(event)
        is_narrow = self.width() < CAPTIONED_FROM
        self.card.set_short(is_narrow)
        self.menu.set_narrow(is_narrow)
        self.resized.emit()

    def minimumSizeHint(self) -> QSize:
        """Return the size from which on all has room, once it is folded."""
        return super().minimumSizeHint().boundedTo(QSize(LEAST_WIDTH, LEAST_HEIGHT))

    def sizeHint(self) -> QSize:
        """Return a size at which nothing is folded."""
        return QSize(CAPTIONED_FROM, LEAST_HEIGHT)

    def add_to_header(self, widget: QWidget) -> None:
        """Add controls at the right of the header."""
        self._header.addWidget(widget)

    def add_panel(self, widget: QWidget) -> None:
        """Add a panel at the right, as high as header and plots."""
        self._row.addWidget(widget)

    def _connect(self) -> None:
        self._state.tf_input.changeFinished.connect(self._follow_range)
        self.area.opacityClicked.connect(self.selection.clear)
        self.area.opacityDoubleClicked.connect(self.opacity.add)
        self.area.opacityMenuRequested.connect(self._opacity_menu)
        self.area.stripClicked.connect(self.color.add)
        self.add_button.clicked.connect(lambda: self.keys.add_in_the_middle())
        self.card.removeRequested.connect(self.remove_selected)
        self.card.colorRequested.connect(self._choose_color)
        self._state.tf_input.changed.connect(self._name_adding)
        QShortcut(QKeySequence("F2"), self, self.card.edit)

    def _name_adding(self) -> None:
        """Say what is added, modes or points."""
        name = f"Add {handle_name(self._state.transfer_function.opacity)}"
        self.add_button.setAccessibleName(name)
        self.add_button.setToolTip(f"{name} (Insert)")

    def _choose_color(self) -> None:
        """Open the colour of the selected stop, or at the selected mode or point."""
        index = self.selection.index("opacity")
        if index is None:
            self.keys.choose_color()
        else:
            handles = edits.opacity_handles(self._state.transfer_function.opacity)
            self.color.choose_color_at(handles[index][0])

    def remove_selected(self) -> None:
        """Remove the selected modes, points or colour stops."""
        self.moves.remove()

    def _opacity_menu(self, value: float, height: float, point: QPoint) -> None:
        text = f"Add {handle_name(self._state.transfer_function.opacity)} here"
        pop_up(self.area.widget, point, (text, lambda: self.opacity.add(value, height), True))
