"""A button that adds a mode, in the colours that are there or in one that stands out."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QMenu, QToolButton

from app.controls import add_action


class AddButton(QToolButton):
    """Adds a mode when clicked; the menu beside it has the same in another colour.

    Parameters
    ----------
    place : str
        Where it adds one, for the tooltip.
    """

    addRequested = Signal(bool)
    """Emitted with whether the mode shall have a colour that stands out."""

    def __init__(self, place: str) -> None:
        super().__init__()
        self.setText("Add")
        self.setToolTip(
            f"Add a mode at {place}: of the listed opacity, in the colour that the TF has there"
        )
        # After a click, keys such as R are the window's again.
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.MenuButtonPopup)
        menu = QMenu(self)
        add_action(menu, "In a colour that stands out", partial(self.addRequested.emit, True))
        self.setMenu(menu)
        self.clicked.connect(lambda: self.addRequested.emit(False))
