"""A notice over the lower middle of an image, with what can be done about it."""

from __future__ import annotations

import math

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app import theme
from app.controls import Action, action_button

MARGIN = 16
"""Least distance from the canvas's edges, in pixels."""

LINE_WIDTH = 480
"""Largest width of the banner, as longer lines are hard to read."""

_STYLE = f"""
QFrame#banner {{
    background: {theme.ON_IMAGE.panel}; border: 1px solid {theme.ON_IMAGE.line}; border-radius: 6px;
}}
"""


class Banner(QFrame):
    """Shows one sentence over a canvas, and up to two buttons; hidden at first.

    It stays in the lower middle of the canvas when that is resized. Escape hides it.

    Parameters
    ----------
    canvas : QWidget
    """

    def __init__(self, canvas: QWidget) -> None:
        super().__init__(canvas)
        self._canvas = canvas
        self.setObjectName("banner")
        self.setStyleSheet(_STYLE)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self._label = QLabel()
        self._label.setTextFormat(Qt.TextFormat.PlainText)
        self._label.setWordWrap(True)
        self._label.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self._buttons = QHBoxLayout()
        self._buttons.setSpacing(8)
        column = self._column = QVBoxLayout(self)
        column.setContentsMargins(14, 10, 14, 10)
        column.setSpacing(8)
        column.addWidget(self._label)
        column.addLayout(self._buttons)
        canvas.installEventFilter(self)
        self.hide()

    @property
    def text(self) -> str:
        """The displayed sentence; empty if the banner is hidden."""
        return "" if self.isHidden() else self._label.text()

    def show_text(self, text: str, *actions: Action) -> None:
        """Show a sentence in place of the present one.

        Parameters
        ----------
        text : str
        *actions : Action
            At most two buttons. Each hides the banner before it acts.

        Raises
        ------
        ValueError
            For more than two actions.
        """
        if len(actions) > 2:
            raise ValueError(f"A banner has room for 2 actions, not {len(actions)}.")
        self._label.setText(text)
        self._clear_buttons()
        self._buttons.addStretch()
        for action in actions:
            button = action_button(action, self.hide)
            self._buttons.addWidget(button)
            # In a visible banner, Qt would show it later, after the banner is placed.
            button.show()
        self._buttons.addStretch()
        self.show()
        self.raise_()
        self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the size of the canvas."""
        if event.type() == QEvent.Type.Resize and not self.isHidden():
            self._place()
        return super().eventFilter(watched, event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Hide on Escape."""
        if event.key() == Qt.Key.Key_Escape and not event.modifiers():
            self.hide()
        else:
            super().keyPressEvent(event)

    def _clear_buttons(self) -> None:
        while (item := self._buttons.takeAt(0)) is not None:
            if (button := item.widget()) is not None:
                button.hide()
                button.deleteLater()

    def _place(self) -> None:
        """Move to the lower middle of the canvas, as wide as the sentence needs."""
        canvas = self._canvas
        around = self._column.contentsMargins()
        limit = min(LINE_WIDTH, canvas.width() - 2 * MARGIN)
        text = self._label.fontMetrics().horizontalAdvance(self._label.text())
        room = max(limit - around.left() - around.right(), 1)
        lines = math.ceil(text / room)
        if lines > 1:
            # Lines of about one length, and some room as words are not divided.
            text = round(1.1 * text / lines)
        # A few pixels more, as Qt would wrap the last word of a sentence that just fits.
        wanted = max(text + 4, self._buttons.sizeHint().width()) + around.left() + around.right()
        width = max(min(wanted, limit), 0)
        height = self._column.totalHeightForWidth(width)
        self.setGeometry(
            (canvas.width() - width) // 2, canvas.height() - height - MARGIN, width, height
        )
