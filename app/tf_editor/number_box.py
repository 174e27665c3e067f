"""A spin box for numbers of any magnitude, shown with enough digits for their range."""

from __future__ import annotations

import math

from PySide6.QtGui import QValidator
from PySide6.QtWidgets import QDoubleSpinBox, QWidget

from app.number_entry import NumberEntry, refusal
from app.typed_numbers import read_number
from model.scene.value_scale import ValueScale, place_of, value_at

_MAX_DECIMALS = 320

SHOWN_DIGITS = 4
"""Digits of a number that are shown, beside those that both limits share."""


HARDLY = 0.05
"""Part of a digit that does not count: limits such as 1 and 255 share none."""


class NumberBox(QDoubleSpinBox):
    """Spin box for numbers such as 1e-9, 0.5 and 3e12; typed numbers apply on Enter or focus loss.

    What is no number, or not within the limits, stays there and says why. On a logarithmic scale
    its value is the logarithm of the number that is shown and typed.

    `valueChanged` is emitted only for changes by the user; see :meth:`show_value`.

    Parameters
    ----------
    is_short : bool
        Whether no zero is shown before the point, where room is scarce.
    """

    def __init__(self, parent: QWidget | None = None, *, is_short: bool = False) -> None:
        super().__init__(parent)
        self._is_short = is_short
        self._digits = 6
        self._meaning = ""
        self._limits: tuple[float, float, ValueScale] | None = None
        self._scale: ValueScale = "linear"
        self.setKeyboardTracking(False)
        self.entry = NumberEntry(self, self._refusal)
        self.lineEdit().setTextMargins(6, 0, 6, 0)
        self.set_limits(0.0, 1.0)

    def explain(self, meaning: str) -> None:
        """Say in the tooltip what the number means, above its limits."""
        self._meaning = meaning
        self._explain()

    def set_limits(self, lo: float, hi: float, scale: ValueScale = "linear") -> None:
        """Set the range, on a scale, and a step of 1/200 of it."""
        if (lo, hi, scale) == self._limits:
            return
        self._limits = lo, hi, scale
        self._scale = scale
        digits = 9 - math.floor(math.log10(hi - lo))
        # Leading digits shared by both limits, as in 1,000,000 and 1,000,001, do not count.
        span = hi - lo if scale == "linear" else 1.0
        common = math.log10(max(abs(lo), abs(hi), span) / span) if scale == "linear" else 0.0
        self._digits = min(SHOWN_DIGITS + math.ceil(common - HARDLY), 17)
        with self.entry.new_limits():
            self.setDecimals(min(max(digits, 0), _MAX_DECIMALS))
            self.setRange(lo, hi)
            self.setSingleStep((hi - lo) / 200)
            self._explain()

    def show_value(self, value: float) -> None:
        """Show a value without emitting a signal; a refused number stays if it is no news."""
        self.entry.show_value(value)

    def _explain(self) -> None:
        lo, hi = self.minimum(), self.maximum()
        limits = f"From {self.textFromValue(lo)} to {self.textFromValue(hi)}"
        self.setToolTip(f"{self._meaning}\n{limits}" if self._meaning else limits)

    def textFromValue(self, value: float) -> str:
        """Format a value with its relevant digits, and never as "-0"."""
        return self._written(value_at(value, self._scale))

    def _written(self, number: float) -> str:
        text = f"{number + 0.0:.{self._digits}g}"
        return text.removeprefix("0") if self._is_short and text.startswith("0.") else text

    def valueFromText(self, text: str) -> float:
        """Read a number; an unchanged text keeps the exact value."""
        if text == self.textFromValue(self.value()):
            return self.value()
        number = read_number(text)
        return place_of(number, self._scale) if number > 0 or self._scale == "linear" else -math.inf

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Accept numbers within the range, and let others be typed."""
        return self.entry.state_of(text), text, position

    def fixup(self, text: str) -> str:
        """Leave it as it is typed."""
        return text

    def _refusal(self, text: str) -> str:
        # Its few digits may lie just outside of the limits where the value itself does not.
        if text == self.textFromValue(self.value()):
            return ""
        lo, hi = (value_at(end, self._scale) for end in (self.minimum(), self.maximum()))
        return refusal(text, lo, hi, self._written)
