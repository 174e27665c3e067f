"""A bar that asks which of a volume's axes points up, where its file does not say."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QToolButton, QWidget

from app.controls import picture_icon, picture_tip
from model.scene.axes import AXES

ICON = 48
"""Side of the pictures on the buttons, in pixels."""

PICTURE = 200
"""Side of the pictures that are shown beside the mouse."""


class UpAxisBar(QFrame):
    """Asks with six buttons, one per axis; hidden until :meth:`ask`, and after the answer."""

    chosen = Signal(str)
    """Emitted with one of :data:`~model.scene.axes.AXES`."""
    dismissed = Signal()
    """Emitted when the user does not want to say."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "panel")
        self._buttons: dict[str, QToolButton] = {}
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 6, 8, 6)
        layout.addWidget(QLabel("Which way is up?"))
        # At the left: at the right, the offer of a training comes and goes.
        self.leave = QPushButton("Hide")
        self.leave.setToolTip("Keep the volume as it stands, and do not ask again")
        self.leave.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.leave.clicked.connect(self._dismiss)
        layout.addWidget(self.leave)
        for axis in AXES:
            button = QToolButton()
            button.setText(axis.replace("-", "−"))
            button.setAutoRaise(True)
            button.setIconSize(QSize(ICON, ICON))
            button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
            button.setAccessibleName(f"{axis} is up")
            # After a click the bar is gone, and another button would have its focus.
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.clicked.connect(partial(self._choose, axis))
            self._buttons[axis] = button
            layout.addWidget(button)
        layout.addStretch()
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
