"""Keys of the window that are letters alone, which can be switched off."""

from __future__ import annotations

from PySide6.QtCore import QObject
from PySide6.QtGui import QAction, QKeySequence

from app.state.preferences import Preferences


class SingleKeys(QObject):
    """Takes the keys that are letters alone from all entries of menus, or gives them back.

    Parameters
    ----------
    window : QObject
        Has the entries.
    """

    def __init__(self, window: QObject, preferences: Preferences) -> None:
        super().__init__(window)
        self._window = window
        self._preferences = preferences
        self._all: dict[QAction, list[QKeySequence]] = {}

    @property
    def are_on(self) -> bool:
        """Whether letters alone are keys."""
        return bool(self._preferences.value("single_keys"))

    def toggle(self) -> None:
        """Switch them off, or on again, and remember that."""
        self._preferences.set(single_keys=not self.are_on)
        self.keep()

    def keep(self) -> None:
        """Have all entries that there are keep to the choice."""
        for action in self._window.findChildren(QAction):
            keys = self._all.setdefault(action, action.shortcuts())
            if any(_is_letter(key) for key in keys):
                action.setShortcuts([key for key in keys if self.are_on or not _is_letter(key)])


def _is_letter(keys: QKeySequence) -> bool:
    """Whether a shortcut is a letter alone."""
    return len(keys.toString()) == 1
