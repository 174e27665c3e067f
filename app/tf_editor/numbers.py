"""Number fields of the selected handle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QFormLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from app import theme
from app.state.viewer_state import ViewerState
from app.tf_editor.moves import HandleMoves
from app.tf_editor.number_box import NumberBox
from app.tf_editor.selection import Selection
from model.scene import tf_editing as edits
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.value_scale import ValueScale

PANEL_WIDTH = 216

WIDTHS: dict[ValueScale, str] = {"linear": "Width", "log": "Decades"}
"""Name of a mode's width; on a logarithmic scale it counts powers of ten."""

WIDTH_MEANING = "Distance from the mean at which the opacity has fallen to 37 %"
OPACITY_MEANING = (
    "Part of the light that is lost over one voxel length: 0 is transparent, 1 is opaque"
)
MEANINGS = {"Width": WIDTH_MEANING, "Opacity": OPACITY_MEANING}


class NumbersPanel(QWidget):
    """Panel with position, width, opacity and colour of the selected handle."""

    addRequested = Signal()
    removeRequested = Signal()
    colorRequested = Signal()

    def __init__(
        self,
        state: ViewerState,
        selection: Selection,
        moves: HandleMoves,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._selection = selection
        self._moves = moves
        self.setFixedWidth(PANEL_WIDTH)
        self.heading = QLabel()
        self.heading.setProperty("role", "title")
        self.value = NumberBox()
        self.width_box = NumberBox()
        self.height_box = NumberBox()
        self.width_box.explain(WIDTH_MEANING)
        self.height_box.explain(OPACITY_MEANING)
        self.color_button = QPushButton()
        self.color_button.setToolTip("Choose the colour")
        self.add_button = QPushButton("Add mode")
        self.remove_button = QPushButton("Remove")
        self._form = QFormLayout()
        self._width_label = QLabel()
        self._lay_out()
        self.value.valueChanged.connect(self._value_typed)
        self.width_box.valueChanged.connect(self._width_typed)
        self.height_box.valueChanged.connect(self._height_typed)
        self.color_button.clicked.connect(self.colorRequested)
        self.add_button.clicked.connect(self.addRequested)
        self.remove_button.clicked.connect(self.removeRequested)
        state.transferFunctionChanged.connect(self.refresh)
        selection.changed.connect(self._forget_refused)
        selection.changed.connect(self.refresh)
        self.refresh()

    def _lay_out(self) -> None:
        self._form.setContentsMargins(0, 0, 0, 0)
        self._form.setVerticalSpacing(6)
        self._form.setLabelAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        for text, field in (
            ("Value", self.value),
            ("Width", self.width_box),
            ("Opacity", self.height_box),
            ("Colour", self.color_button),
        ):
            label = self._width_label if field is self.width_box else QLabel()
            label.setText(text)
            label.setProperty("role", "dim")
            label.setToolTip(MEANINGS.get(text, ""))
            label.setMinimumSize(64, self.value.sizeHint().height())
            self._form.addRow(label, field)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self.heading)
        layout.addLayout(self._form)
        layout.addStretch()
        layout.addWidget(self.remove_button)
        layout.addWidget(self.add_button)

    def _forget_refused(self) -> None:
        """Let go of numbers that were refused: they were another handle's."""
        for box in (self.value, self.width_box, self.height_box):
            box.entry.forget()

    def refresh(self) -> None:
        """Show the present numbers of the selected handle."""
        tf = self._state.transfer_function
        mode_or_point = self._selection.index("opacity")
        stop = self._selection.index("color")
        self.add_button.setText("Add point" if tf.opacity.points else "Add mode")
        if mode_or_point is not None:
            self._show_opacity_handle(tf.opacity, mode_or_point)
        elif stop is not None:
            self._show_stop(tf.color, stop)
        else:
            self.heading.setText("Nothing selected")
            self._show_rows()
            self.remove_button.setEnabled(False)

    def _show_opacity_handle(self, opacity: OpacityTF, index: int) -> None:
        handles = edits.opacity_handles(opacity)
        lo, hi = opacity.scalar_range
        value, height = handles[index]
        name = "Point" if opacity.points else "Mode"
        count = len(self._selection.indices("opacity"))
        more = f", {count} selected" if count > 1 else ""
        self.heading.setText(f"{name} {index + 1} of {len(handles)}{more}")
        self._set_value(edits.opacity_limits(opacity, index), value)
        self.height_box.show_value(height)
        if opacity.points:
            self._show_rows(self.value, self.height_box)
        else:
            self.width_box.set_limits(opacity.bin_width, hi - lo)
            self.width_box.show_value(opacity.modes[index].width)
            self._width_label.setText(WIDTHS[opacity.scale])
            self._show_rows(self.value, self.width_box, self.height_box)
        self.remove_button.setEnabled(edits.can_remove_opacity_handle(opacity, index))

    def _show_stop(self, color: ColorTF, index: int) -> None:
        value, *rgb = color.stops[index]
        count = len(self._selection.indices("color"))
        more = f", {count} selected" if count > 1 else ""
        self.heading.setText(f"Colour stop {index + 1} of {len(color.stops)}{more}")
        self._set_value(edits.stop_limits(color, index), value)
        fill = QColor.fromRgbF(*rgb).name()
        self.color_button.setStyleSheet(
            f"background: {fill}; border: 1px solid {theme.BORDER}; min-height: 16px;"
        )
        self._show_rows(self.value, self.color_button)
        self.remove_button.setEnabled(not edits.is_end_stop(color, index))

    def _set_value(self, limits: tuple[float, float], value: float) -> None:
        # An end is fixed.
        self.value.setEnabled(limits[0] < limits[1])
        if self.value.isEnabled():
            self.value.set_limits(*limits, self._state.scale)
        else:
            self.value.set_limits(*self._state.scalar_range, self._state.scale)
        self.value.show_value(value)

    def _show_rows(self, *shown: QWidget) -> None:
        for field in (self.value, self.width_box, self.height_box, self.color_button):
            self._form.setRowVisible(field, field in shown)

    def _value_typed(self, value: float) -> None:
        index = self._selection.index("opacity")
        stop = self._selection.index("color")
        if index is not None:
            at = edits.opacity_handles(self._state.transfer_function.opacity)[index]
            self._edit_opacity(lambda o: edits.move_opacity_handle(o, index, value, at[1]), "value")
        elif stop is not None:
            tf = self._state.transfer_function
            color = edits.move_stop(tf.color, stop, value)
            self._state.commit(replace(tf, color=color), "move colour stop", f"stop {stop}")
            self.refresh()

    def _height_typed(self, height: float) -> None:
        index = self._selection.index("opacity")
        if index is not None:
            at = edits.opacity_handles(self._state.transfer_function.opacity)[index]
            self._edit_opacity(
                lambda o: edits.move_opacity_handle(o, index, at[0], height), "opacity"
            )

    def _width_typed(self, width: float) -> None:
        index = self._selection.index("opacity")
        if index is not None:
            self._edit_opacity(lambda o: edits.resize_mode(o, index, width), "width")

    def _edit_opacity(self, edit: Callable[[OpacityTF], OpacityTF], what: str) -> None:
        tf = self._state.transfer_function
        index = self._selection.index("opacity")
        after = self._moves.with_opacity(tf, edit(tf.opacity))
        self._state.commit(after, f"set {what}", f"{what} {index}")
        # Even if the edit changed nothing, so that a number outside the limits is replaced.
        self.refresh()
