"""Non-blocking context menus."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QMenu, QWidget


def pop_up(
    parent: QWidget, point: QPoint, *entries: tuple[str, Callable[[], object], bool]
) -> QMenu:
    """Open a menu at a point of the screen.

    Parameters
    ----------
    *entries : tuple
        Text, function to call, and True if the entry is enabled.
    """
    menu = QMenu(parent)
    for text, call, enabled in entries:
        action = menu.addAction(text)
        action.setEnabled(enabled)
        action.triggered.connect(lambda _checked=False, call=call: call())
    menu.aboutToHide.connect(menu.deleteLater)
    menu.popup(point)
    return menu
