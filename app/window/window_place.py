"""Where the window opens, and how large it is: inside a screen that is there."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QPoint, QRect, QSize
from PySide6.QtGui import QGuiApplication, QScreen

SHARE = 0.8
"""Of the screen's free area, along both sides."""

LARGEST, LEAST = QSize(1440, 900), QSize(1000, 640)
"""Size at which it opens at most, and at which everything in it can be used."""

FRAME = 32
"""Height that the system's title bar takes of a free area, about; it is not the window's."""

LEAST_SEEN = 80
"""Pixels of the window's upper edge that have to be on a screen, so that it can be moved."""


def size_on(screen: QScreen) -> QSize:
    """Return the size at which the window opens on a screen."""
    if QGuiApplication.platformName() == "offscreen":
        # Where nothing is seen, Qt has a smaller screen than anybody.
        return LARGEST
    return first_size(screen.availableSize())


def first_size(free: QSize) -> QSize:
    """Return the size at which the window opens.

    Parameters
    ----------
    free : QSize
        Of the screen, without bars of the system.
    """
    part = QSize(round(SHARE * free.width()), round(SHARE * free.height()))
    inside = QSize(free.width(), free.height() - FRAME)
    return part.boundedTo(LARGEST).expandedTo(LEAST).boundedTo(inside)


def fitting_place(window: QRect, screens: Sequence[QRect], here: QRect) -> QRect:
    """Return where a window lies that was there before, if that still is on a screen.

    Parameters
    ----------
    window : QRect
        Its place when it was seen last.
    screens : sequence of QRect
        Free areas of the screens that are there.
    here : QRect
        The one of them where a window is put that is on none: in its middle.
    """
    top = QRect(window.left(), window.top(), window.width(), 1)
    for screen in screens:
        seen = screen.intersected(top)
        if not seen.isEmpty() and seen.width() >= min(LEAST_SEEN, window.width()):
            return _within(window, screen)
    placed = QRect(QPoint(0, 0), window.size().boundedTo(here.size()))
    placed.moveCenter(here.center())
    return placed


def _within(window: QRect, screen: QRect) -> QRect:
    """Make a window no larger than its screen, and move it inside if it was cut."""
    size = window.size().boundedTo(screen.size())
    left = min(max(window.left(), screen.left()), screen.right() + 1 - size.width())
    upper = min(max(window.top(), screen.top()), screen.bottom() + 1 - size.height())
    return QRect(QPoint(left, upper), size)
