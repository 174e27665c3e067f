"""A spin box for numbers of any magnitude, shown with six significant digits of their range."""

from __future__ import annotations

import math

from PySide6.QtGui import QValidator
from PySide6.QtWidgets import QDoubleSpinBox, QToolTip, QWidget

_MAX_DECIMALS = 320


class NumberBox(QDoubleSpinBox):
    """Takes 1e-9 and 3e12 as well as 0.5; a typed number counts at Enter or on leaving.

    Setting a value from outside is silent: `valueChanged` means the user.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._digits = 6
        self.setKeyboardTracking(False)
        self.lineEdit().setTextMargins(6, 0, 6, 0)
        self.set_limits(0.0, 1.0)

    def set_limits(self, lo: float, hi: float) -> None:
        """Set the range, and a step of a two-hundredth of it."""
        self.blockSignals(True)
        digits = 9 - math.floor(math.log10(hi - lo))
        self.setDecimals(min(max(digits, 0), _MAX_DECIMALS))
        # Between 1,000,000 and 1,000,001 the first six digits tell nothing.
        common = math.log10(max(abs(lo), abs(hi), hi - lo) / (hi - lo))
        self._digits = min(6 + math.ceil(common), 17)
        self.setRange(lo, hi)
        self.setSingleStep((hi - lo) / 200)
        self.setToolTip(f"From {self.textFromValue(lo)} to {self.textFromValue(hi)}")
        self.blockSignals(False)

    def show_value(self, value: float) -> None:
        """Show a value without telling anyone."""
        self.blockSignals(True)
        self.setValue(value)
        self.blockSignals(False)

    def textFromValue(self, value: float) -> str:
        """Return six digits that matter; a minus sign never stands before a bare zero."""
        return f"{value + 0.0:.{self._digits}g}"

    def valueFromText(self, text: str) -> float:
        """Return the number; the text as it was shown means the value as it was."""
        if text == self.textFromValue(self.value()):
            return self.value()
        return float(text.replace(",", "."))

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Accept what Python reads as a finite number, in the C notation."""
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
        """Bring a number outside the range to its nearer end, and show the range."""
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
