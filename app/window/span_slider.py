"""A slider with two ends, for a span of 0 to 1."""

from __future__ import annotations

from typing import Literal

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QHideEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from app import theme

KNOB, HEIGHT = 9, 24
"""Width of an end's knob, and height of the slider, in pixels."""

GROOVE = 4
PAGE = 10
"""Steps of page up and page down."""

LEAST_WIDTH = 40

Part = Literal["low", "high", "span"]

_STEPS: dict[int, int] = {
    Qt.Key.Key_Left: -1,
    Qt.Key.Key_Down: -1,
    Qt.Key.Key_Right: 1,
    Qt.Key.Key_Up: 1,
    Qt.Key.Key_PageDown: -PAGE,
    Qt.Key.Key_PageUp: PAGE,
}


class SpanSlider(QWidget):
    """Changes where a span begins and ends; its middle moves both.

    The knobs stand on the outer sides of their ends, so that they never cover each other.
    With the focus, Tab goes from the lower end to the upper one. Arrow keys move an end by a
    step, the page keys by ten, with Ctrl they move the whole span; Home and End go to the limits.
    """

    moved = Signal(float, float)
    """Emitted with both ends at every step of a change by the user."""
    released = Signal()
    """Emitted at the end of a change by the user."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._low, self._high = 0.0, 1.0
        self._least = self._step = 0.01
        self._part: Part = "low"
        self._hovered: Part | None = None
        self._grip: tuple[float, float, float] | None = None
        self._changing = False
        self.setMinimumSize(LEAST_WIDTH, HEIGHT)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    @property
    def span(self) -> tuple[float, float]:
        """Both ends, 0 <= low < high <= 1."""
        return self._low, self._high

    @property
    def part(self) -> Part:
        """What the keys move: the lower or the upper end, or both after a drag of the middle."""
        return self._part

    def set_span(self, low: float, high: float) -> None:
        """Show other ends, without a signal."""
        if (low, high) != self.span:
            self._low, self._high = low, high
            self.update()

    def set_steps(self, step: float, least: float) -> None:
        """Set the step of the keys, and the least length of the span."""
        self._step, self._least = step, least

    def x_of(self, value: float) -> float:
        """Return the pixel of a value."""
        return KNOB + 1 + value * self._groove_width

    def sizeHint(self) -> QSize:
        """Return a size with room for two knobs and a span."""
        return QSize(120, HEIGHT)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold of an end or the middle; beside the span, bring the nearest end there."""
        if event.button() != Qt.MouseButton.LeftButton:
            event.ignore()
            return
        self._part = self._part_at(event.position())
        value = self._value_at(event.position())
        held = {"low": self._low, "high": self._high, "span": self._low}[self._part]
        beside = event.position().x() < self.x_of(self._low) - KNOB
        if beside or event.position().x() > self.x_of(self._high) + KNOB:
            held = value
        self._grip = value - held, self._low, self._high
        self._move(self._part, held, self._low, self._high)
        self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move what is held."""
        if self._grip is not None:
            offset, low, high = self._grip
            self._move(self._part, self._value_at(event.position()) - offset, low, high)
        else:
            self._hover(self._part_at(event.position()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the drag."""
        if self._grip is not None and event.button() == Qt.MouseButton.LeftButton:
            self._finish()
            self._hover(self._part_at(event.position()))

    def leaveEvent(self, event: QEvent) -> None:
        """Mark nothing."""
        self._hover(None)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move an end, or with Ctrl the whole span."""
        control = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        part: Part = "span" if control else self._part
        held = self._high if part == "high" else self._low
        if event.key() in _STEPS:
            target = held + _STEPS[event.key()] * self._step
        elif event.key() in (Qt.Key.Key_Home, Qt.Key.Key_End):
            target = 0.0 if event.key() == Qt.Key.Key_Home else 1.0
        else:
            super().keyPressEvent(event)
            return
        self._move(part, target, self._low, self._high)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """End the change when no key repeats any more."""
        if event.isAutoRepeat():
            return
        self._finish()
        super().keyReleaseEvent(event)

    def focusNextPrevChild(self, next: bool) -> bool:
        """Go to the other end before leaving."""
        if next == (self._part != "high"):
            self._part = "high" if next else "low"
            self._finish()
            self.update()
            return True
        return super().focusNextPrevChild(next)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Begin at the lower end, or coming back at the upper one."""
        if event.reason() == Qt.FocusReason.TabFocusReason:
            self._part = "low"
        elif event.reason() == Qt.FocusReason.BacktabFocusReason:
            self._part = "high"
        super().focusInEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """End the change, as nobody tells of a key's release."""
        self._finish()
        super().focusOutEvent(event)

    def hideEvent(self, event: QHideEvent) -> None:
        """End the change, as nobody tells of the mouse's release."""
        self._finish()
        super().hideEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the groove, the span and its knobs; what the keys move has a bright rim."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle = self.height() / 2
        left, right = self.x_of(self._low), self.x_of(self._high)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.ON_IMAGE.line))
        groove = QRectF(self.x_of(0.0), middle - GROOVE / 2, self._groove_width, GROOVE)
        painter.drawRoundedRect(groove, 2, 2)
        painter.setBrush(self._color("span", theme.ON_IMAGE.change))
        painter.drawRect(QRectF(left, middle - GROOVE / 2, right - left, GROOVE))
        for part, x in (("low", left - KNOB), ("high", right)):
            chosen = self.hasFocus() and self._part in (part, "span")
            rim = theme.ON_IMAGE.change if chosen else theme.ON_IMAGE.window
            painter.setPen(QPen(QColor(rim), 2.0))
            painter.setBrush(self._color(part, theme.ON_IMAGE.dim))
            painter.drawRoundedRect(QRectF(x + 1, middle - 8, KNOB - 2, 16), 3, 3)
        painter.end()

    @property
    def _groove_width(self) -> float:
        return max(self.width() - 2 * KNOB - 2, 1)

    def _color(self, part: str, usual: str) -> QColor:
        held = self._grip is not None and self._part == part
        return QColor(theme.ON_IMAGE.text if held or self._hovered == part else usual)

    def _value_at(self, position: QPointF) -> float:
        return (position.x() - self.x_of(0.0)) / self._groove_width

    def _part_at(self, position: QPointF) -> Part:
        if position.x() <= self.x_of(self._low):
            return "low"
        return "high" if position.x() >= self.x_of(self._high) else "span"

    def _hover(self, part: Part | None) -> None:
        if part != self._hovered:
            self._hovered = part
            self.update()

    def _move(self, part: Part, target: float, low: float, high: float) -> None:
        """Bring a part of a span to a value, as far as the limits and its least length allow."""
        if part == "low":
            low = min(max(target, 0.0), max(high - self._least, 0.0))
        elif part == "high":
            high = max(min(target, 1.0), min(low + self._least, 1.0))
        else:
            # A slab stops at the border and keeps its thickness.
            shift = min(max(target - low, -low), 1.0 - high)
            low, high = low + shift, min(high + shift, 1.0)
        if (low, high) != self.span:
            self.set_span(low, high)
            self._changing = True
            self.moved.emit(low, high)

    def _finish(self) -> None:
        self._grip = None
        if self._changing:
            self._changing = False
            self.released.emit()
        self.update()
