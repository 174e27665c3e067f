"""Number boxes that keep every typed digit, and numbers as short texts."""

import math
from collections.abc import Mapping

from PySide6.QtCore import QEvent, QObject, QPoint, QSignalBlocker, Qt
from PySide6.QtGui import QKeyEvent, QValidator
from PySide6.QtWidgets import QDoubleSpinBox, QSpinBox, QToolTip, QWidget

from app.controls import WheelGuard
from model.scene.ranges import without_zero
from model.scene.value_scale import ValueScale, place_of, value_at

MINUS = "\N{MINUS SIGN}"

SMALLEST, LARGEST = 1e-4, 1e5
MILLION = 1e6  # numbers between which no power of ten is written


def short(number: float, digits: int = 2, *, signed: bool = False) -> str:
    """Write a number with few significant digits, such as ``".004"``, ``"−.02"`` or ``"2e−5"``."""
    size = abs(number)
    if SMALLEST <= size < 1:
        # A fifth decimal would only be noise.
        size = round(size, 4)
    text = f"{size:.{digits}g}" if size < 10**digits else f"{size:.0f}"
    if 0 < size < SMALLEST or size >= LARGEST:
        digit, _, power = f"{size:.{digits - 1}e}".partition("e")
        text = f"{float(digit):g}e{int(power)}".replace("-", MINUS)
    else:
        text = without_zero(text)
    sign = "" if not size else MINUS if number < 0 else "+" if signed else ""
    return sign + text


def significant(number: float, digits: int) -> str:
    """Format a number with a limited number of significant digits: ``"2480"``, ``".05"``."""
    size = abs(number)
    if not size or not SMALLEST <= size < MILLION:
        return f"{number + 0.0:.{digits}g}"
    text = f"{number:.{max(digits - 1 - math.floor(math.log10(size)), 0)}f}"
    return without_zero(text.rstrip("0").rstrip(".") if "." in text else text)


CHARACTERS = set("0123456789+-.,eE ")
"""Characters of numbers. A comma belongs to none, but dropping it would change the number."""

MOST_DECIMALS = 320  # enough that no number is rounded

SHOWN_DIGITS, TYPED_DIGITS = 3, 6
"""Digits shown of a number, and of a typed one, besides leading digits that both limits share."""

HARDLY = 0.3  # part of a digit that is ignored: limits such as 100 and 250 share no digits


class WholeNumberBox(QSpinBox):
    """Spin box for whole numbers that keeps every typed digit; Qt's own rejects some above 400."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        _Typing(self)

    def set_limits(self, lowest: int, highest: int) -> None:
        """Set the range without emitting a signal."""
        with QSignalBlocker(self):
            self.setRange(lowest, highest)

    def show_value(self, value: int) -> None:
        """Show a value without emitting a signal."""
        with QSignalBlocker(self):
            self.setValue(value)

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Accept numbers within the range, and let others be typed."""
        return _state(self, self._number(text)), text, position

    def valueFromText(self, text: str) -> int:
        """Read a number that is accepted."""
        return int(self._number(text))

    def _number(self, text: str) -> str:
        return text.removeprefix(self.prefix()).removesuffix(self.suffix())

    def fixup(self, text: str) -> str:
        """Change nothing, so that no other number results, as by dropping a comma."""
        return text


class NumberBox(QDoubleSpinBox):
    """Spin box for numbers such as 1e-9, 0.5 and 3e12; they apply on Enter or focus loss.

    On a logarithmic scale, its value is the logarithm of the shown number. `valueChanged` is
    emitted for changes by the user alone. The tooltip has the meaning, then the limits.
    """

    def __init__(self, meaning: str = "") -> None:
        super().__init__()
        self.meaning = meaning
        self._digits = SHOWN_DIGITS
        self._typed: float | None = None
        self._scale: ValueScale = "linear"
        self.numbers: Mapping[int, int] = {}  # shown and typed for whole values
        self.setKeyboardTracking(False)
        self.setDecimals(MOST_DECIMALS)
        _Typing(self)
        self.set_limits(0.0, 1.0)

    def set_limits(self, lo: float, hi: float, scale: ValueScale = "linear") -> None:
        """Set the range, on a scale, and a step of 1/200 of it, without emitting a signal."""
        self._scale = scale
        # Leading digits shared by both limits, as in 1,000,000 and 1,000,001, do not count.
        span = hi - lo if scale == "linear" else 1.0
        common = math.log10(max(abs(lo), abs(hi), span) / span) if scale == "linear" else 0.0
        self._digits = min(SHOWN_DIGITS + math.ceil(common - HARDLY), 17)
        with QSignalBlocker(self):
            self.setRange(lo, hi)
        self.setSingleStep((hi - lo) / 200)
        limits = f"From {self.textFromValue(lo)} to {self.textFromValue(hi)}"
        self.setToolTip(f"{self.meaning}\n{limits}" if self.meaning else limits)

    def show_value(self, value: float) -> None:
        """Show a value without emitting a signal."""
        with QSignalBlocker(self):
            self.setValue(value)

    def textFromValue(self, value: float) -> str:
        """Format a value with its relevant digits, and never as "-0"."""
        if value in self.numbers:
            return f"{self.numbers[int(value)]}"
        more = TYPED_DIGITS - SHOWN_DIGITS if value == self._typed else 0
        number = value_at(value, self._scale) + 0.0
        return significant(number, min(self._digits + more, 17))

    def valueFromText(self, text: str) -> float:
        """Read a number; an unchanged text keeps the exact value."""
        if text == self.textFromValue(self.value()):
            return self.value()
        if self.numbers:
            named = {f"{number}": float(value) for value, number in self.numbers.items()}
            return named.get(text.strip(), math.nan)
        number, is_place = float(text), self._scale == "linear"
        self._typed = place_of(number, self._scale) if number > 0 or is_place else -math.inf
        return self._typed

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Accept numbers within the range, and let others be typed."""
        return _state(self, text), text, position


def _state(box: WholeNumberBox | NumberBox, text: str) -> QValidator.State:
    if not CHARACTERS.issuperset(text):
        return QValidator.State.Invalid
    try:
        fits = box.minimum() <= box.valueFromText(text) <= box.maximum()
    except ValueError:
        fits = False
    return QValidator.State.Acceptable if fits else QValidator.State.Intermediate


class _Typing(QObject):
    """Marks an invalid text; Escape, or leaving the box, restores the last number."""

    def __init__(self, box: QSpinBox | QDoubleSpinBox) -> None:
        super().__init__(box)
        self._box = box
        WheelGuard(box)
        box.installEventFilter(self)
        box.lineEdit().textChanged.connect(self._mark)
        box.editingFinished.connect(self._mark)
        # Letters are shortcuts again, and Tab goes on from here.
        box.lineEdit().returnPressed.connect(lambda: (box.parentWidget() or box).setFocus())

    def eventFilter(self, _box: QObject, event: QEvent) -> bool:
        """Say at Enter why a text is invalid, and let Escape discard a text."""
        if not isinstance(event, QKeyEvent) or event.type() != QEvent.Type.KeyPress:
            return False
        line = self._box.lineEdit()
        if event.key() == Qt.Key.Key_Escape and line.isModified():
            with QSignalBlocker(self._box):
                self._box.setValue(self._box.value())  # type: ignore[arg-type]
            self._box.selectAll()
            self._mark()
            return True
        is_enter = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        is_refused = is_enter and not self._box.hasAcceptableInput()
        if is_refused:
            # It has the limits.
            QToolTip.showText(self._box.mapToGlobal(QPoint(0, 0)), self._box.toolTip(), self._box)
        return is_refused

    def _mark(self) -> None:
        self._box.setProperty("refused", not self._box.hasAcceptableInput())
        self._box.style().polish(self._box)
