"""A spin box for numbers of any magnitude, shown with enough digits for their range."""

from __future__ import annotations

import math

from PySide6.QtGui import QValidator
from PySide6.QtWidgets import QDoubleSpinBox, QToolTip, QWidget

from app.number_entry import NumberKeys

_MAX_DECIMALS = 320

SHOWN_DIGITS = 4
"""Digits of a number that are shown, beside those that both limits share."""


class NumberBox(QDoubleSpinBox):
    """Spin box for numbers such as 1e-9, 0.5 and 3e12; typed numbers apply on Enter or focus loss.

    `valueChanged` is emitted only for changes by the user; see :meth:`show_value`.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._digits = 6
        self._meaning = ""
        self.setKeyboardTracking(False)
        NumberKeys(self)
        self.lineEdit().setTextMargins(6, 0, 6, 0)
        self.set_limits(0.0, 1.0)

    def explain(self, meaning: str) -> None:
        """Say in the tooltip what the number means, above its limits."""
        self._meaning = meaning
        self.set_limits(self.minimum(), self.maximum())

    def set_limits(self, lo: float, hi: float) -> None:
        """Set the range, and a step of 1/200 of it."""
        self.blockSignals(True)
        digits = 9 - math.floor(math.log10(hi - lo))
        self.setDecimals(min(max(digits, 0), _MAX_DECIMALS))
        # Leading digits shared by both limits, as in 1,000,000 and 1,000,001, do not count.
        common = math.log10(max(abs(lo), abs(hi), hi - lo) / (hi - lo))
        self._digits = min(SHOWN_DIGITS + math.ceil(common), 17)
        self.setRange(lo, hi)
        self.setSingleStep((hi - lo) / 200)
        limits = f"From {self.textFromValue(lo)} to {self.textFromValue(hi)}"
        self.setToolTip(f"{self._meaning}\n{limits}" if self._meaning else limits)
        self.blockSignals(False)

    def show_value(self, value: float) -> None:
        """Show a value without emitting a signal."""
        self.blockSignals(True)
        self.setValue(value)
        self.blockSignals(False)

    def textFromValue(self, value: float) -> str:
        """Format a value with its relevant digits, and never as "-0"."""
        return f"{value + 0.0:.{self._digits}g}"

    def valueFromText(self, text: str) -> float:
        """Parse a number; an unchanged text keeps the exact value."""
        if text == self.textFromValue(self.value()):
            return self.value()
        return float(text.replace(",", "."))

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Accept numbers within the range, with a decimal point or comma."""
        try:
            number = float(text.replace(",", "."))
        except ValueError:
            allowed = set(text) <= set("+-.,eE0123456789")
            state = QValidator.State.Intermediate if allowed else QValidator.State.Invalid
        else:
            inside = self.minimum() <= number <= self.maximum()
            state = QValidator.State.Acceptable if inside else QValidator.State.Intermediate
        return state, text, position

    def fixup(self, text: str) -> str:
        """Clamp a number to the range, and show the range if it was outside."""
        try:
            number = float(text.replace(",", "."))
        except ValueError:
            return self.textFromValue(self.value())
        if math.isnan(number):
            return self.textFromValue(self.value())
        nearest = min(max(number, self.minimum()), self.maximum())
        if nearest != number:
            QToolTip.showText(self.mapToGlobal(self.rect().bottomLeft()), self.toolTip(), self)
        return repr(nearest)
