"""A flag over the plot that marks a peak, says what an edit there does, and makes it."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QToolButton, QWidget

HEIGHT = 19
GAP = 3
"""Least distance between two flags, in pixels."""


class PeakFlag(QToolButton):
    """A numbered flag that can be clicked, or reached by Tab and pressed by Enter."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number
        self.setProperty("role", "change flag")
        self.setFixedHeight(HEIGHT)
        # After a click, keys such as W are the window's again.
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        # Two clicks on one that is dim are no double click in the plot.
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.say("", "")

    def say(self, effect: str, name: str) -> bool:
        """Show what the edit does; the name says it in words. Return whether that is news."""
        text = f"{self.number}  {effect}".rstrip()
        if (text, name) == (self.text(), self.accessibleName()):
            return False
        self.setText(text)
        self.setAccessibleName(name)
        self.setToolTip(f"{name}\nClick to add a mode here".lstrip())
        self.adjustSize()
        return True

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Make the edit by Enter."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.click()
        else:
            super().keyPressEvent(event)


def place_flags(flags: Sequence[QWidget], centers: Sequence[int], plot: QRect) -> None:
    """Put flags at the upper edge of a plot, over their places, beside one another.

    Parameters
    ----------
    centers : sequence of int
        Where each would stand in the middle, in pixels.
    """
    order = sorted(range(len(flags)), key=lambda index: centers[index])
    lefts = [0] * len(flags)
    free = plot.left()
    for index in order:
        width = flags[index].width()
        lefts[index] = max(free, centers[index] - width // 2)
        free = lefts[index] + width + GAP
    # What would reach beyond the right edge goes back, and pushes its neighbours.
    end = plot.right() + 1
    for index in reversed(order):
        width = flags[index].width()
        lefts[index] = min(lefts[index], end - width)
        end = lefts[index] - GAP
    for flag, left in zip(flags, lefts, strict=True):
        flag.move(left, plot.top())
