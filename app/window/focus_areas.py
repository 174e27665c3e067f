"""F6 and Shift+F6: from one area of the window to the next, and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QApplication, QWidget


class FocusAreas(QObject):
    """Moves the focus between areas, in the order in which they are given.

    Parameters
    ----------
    areas : callable
        Returns the areas; those that are hidden or take no keys are passed over.
    """

    def __init__(self, window: QWidget, areas: Callable[[], Sequence[QWidget]]) -> None:
        super().__init__(window)
        self._areas = areas
        for keys, step in (("F6", 1), ("Shift+F6", -1)):
            shortcut = QShortcut(QKeySequence(keys), window)
            shortcut.activated.connect(lambda step=step: self.move(step))

    def move(self, step: int) -> None:
        """Give the focus to the area that many places further on."""
        areas = [area for area in self._areas() if _first_in(area) is not None]
        focus = QApplication.focusWidget()
        here = [
            place
            for place, area in enumerate(areas)
            if focus is not None and (area is focus or area.isAncestorOf(focus))
        ]
        # From nowhere, forwards begins at the first one, and backwards at the last.
        start = here[-1] if here else (-1 if step > 0 else 0)
        wanted = _first_in(areas[(start + step) % len(areas)]) if areas else None
        if wanted is not None:
            wanted.setFocus(Qt.FocusReason.TabFocusReason)


def _first_in(area: QWidget) -> QWidget | None:
    """Return the first widget of an area that Tab can reach; None if there is none."""
    for widget in (area, *area.findChildren(QWidget)):
        takes = bool(widget.focusPolicy() & Qt.FocusPolicy.TabFocus)
        if takes and widget.isVisible() and widget.isEnabled() and widget.focusProxy() is None:
            return widget
    return None
