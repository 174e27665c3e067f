"""A popup with the two numbers of the TF's range."""

from __future__ import annotations

from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QFormLayout, QFrame, QLabel, QWidget

from app.number_box import NumberBox
from app.short_numbers import significant
from app.state.viewer_state import ViewerState
from app.tf_editor.range_layer import RangeLayer
from model.scene.transfer_function import Range
from model.scene.value_scale import values_at

_LEAST_SHARE = 1e-6
"""Smallest range that can be typed, as a fraction of the volume's."""


class RangePopup(QFrame):
    """Shows the range of the state's TF and takes typed numbers, each as an undo step."""

    def __init__(self, state: ViewerState, layer: RangeLayer, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setProperty("role", "panel")
        self._state = state
        self._layer = layer
        self._data_range: Range = (0.0, 1.0)
        self.low, self.high = NumberBox(), NumberBox()
        self._hint = QLabel()
        self._hint.setProperty("role", "dim")
        form = QFormLayout(self)
        form.addRow("From", self.low)
        form.addRow("to", self.high)
        form.addRow(self._hint)
        self.low.valueChanged.connect(lambda low: self._typed((low, state.scalar_range[1])))
        self.high.valueChanged.connect(lambda high: self._typed((state.scalar_range[0], high)))
        state.tf_input.changed.connect(self._refresh)
        for box in (self.low, self.high):
            box.lineEdit().returnPressed.connect(self.close)

    def open_at(self, point: QPoint, data_range: Range) -> None:
        """Open at a point of the screen, for a volume with these values."""
        self._data_range = data_range
        low, high = values_at(data_range, self._state.scale)
        self._hint.setText(f"Values of the volume: {significant(low, 5)} to {significant(high, 5)}")
        self._refresh()
        self.move(point)
        self.show()
        self.low.setFocus()
        self.low.selectAll()

    def _refresh(self) -> None:
        if self.isHidden() and not self._hint.text():
            return
        lo, hi = self._state.scalar_range
        first, last = min(self._data_range[0], lo), max(self._data_range[1], hi)
        span = last - first
        least = _LEAST_SHARE * (self._data_range[1] - self._data_range[0])
        # A range wider than the data is allowed, as for TFs that several volumes share.
        scale = self._state.scale
        self.low.set_limits(first - span, max(hi - least, lo), scale)
        self.high.set_limits(min(lo + least, hi), last + span, scale)
        self.low.show_value(lo)
        self.high.show_value(hi)

    def _typed(self, scalar_range: Range) -> None:
        if scalar_range[0] < scalar_range[1]:
            self._layer.set_range(scalar_range)
        self._refresh()
