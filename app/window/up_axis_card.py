"""A card that asks which of a volume's axes points up, where its file does not say."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from app import theme
from app.controls import picture_icon, picture_tip
from app.icons import IconButton
from model.scene.axes import AXES

ICON = 56
"""Side of the pictures on the buttons, in pixels."""

PICTURE = 200
"""Side of the pictures that are shown beside the mouse."""


class UpAxisCard(QFrame):
    """Asks with six buttons, one per axis; hidden until :meth:`ask`, and after the answer."""

    chosen = Signal(str)
    """Emitted with one of :data:`~model.scene.axes.AXES`."""
    dismissed = Signal()
    """Emitted when the user does not want to say."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "card")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self._buttons: dict[str, QToolButton] = {}
        title = QLabel("Which way is up?")
        title.setProperty("role", "title")
        self.leave = IconButton(
            "close",
            "Leave it",
            tip="Keep the volume as it stands, and do not ask again",
            colors=theme.ON_IMAGE,
        )
        self.leave.clicked.connect(self._dismiss)
        head = QHBoxLayout()
        head.addWidget(title)
        head.addStretch()
        head.addWidget(self.leave)
        pictures = QHBoxLayout()
        pictures.setSpacing(4)
        for axis in AXES:
            button = QToolButton()
            button.setText(axis.replace("-", "−"))
            button.setIconSize(QSize(ICON, ICON))
            button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextUnderIcon)
            button.setAccessibleName(f"{axis} is up")
            # After a click the card is gone, and another button would have its focus.
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.clicked.connect(partial(self._choose, axis))
            self._buttons[axis] = button
            pictures.addWidget(button)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 4, 8, 8)
        column.setSpacing(2)
        column.addLayout(head)
        column.addLayout(pictures)
        self.hide()

    def ask(self, present: str = "") -> None:
        """Show the question, without pictures until they are set.

        Parameters
        ----------
        present : str
            Axis that points up now; its button is marked. Empty for none.
        """
        self.set_pictures({})
        for axis, button in self._buttons.items():
            button.setCheckable(axis == present)
            button.setChecked(axis == present)
        self.show()

    def set_pictures(self, pictures: Mapping[str, QImage]) -> None:
        """Show on each button how the volume looks with its axis up.

        Parameters
        ----------
        pictures : mapping of str to QImage
            By axis, with sides of :data:`PICTURE`; a button without one has three dots.
        """
        for axis, button in self._buttons.items():
            picture = pictures.get(axis)
            text = f"Stand the volume upright with {axis} of its file at the top"
            button.setIcon(picture_icon(picture, ICON))
            button.setToolTip(text if picture is None else picture_tip(picture, text))

    def button(self, axis: str) -> QToolButton:
        """Return an axis' button."""
        return self._buttons[axis]

    def _choose(self, axis: str, _checked: bool = False) -> None:
        self.hide()
        self.chosen.emit(axis)

    def _dismiss(self) -> None:
        self.hide()
        self.dismissed.emit()
