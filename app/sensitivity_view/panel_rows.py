"""Rows of the panel of findings: a value or an edit, with its buttons while it is pointed at."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from PySide6.QtCore import QEvent, QObject, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QEnterEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QAbstractButton, QHBoxLayout, QLabel, QMenu, QToolButton, QWidget

from app import theme
from app.controls import ElidedLabel, add_action


class AddButton(QToolButton):
    """Adds a mode when clicked; the menu next to it has the same in another colour."""

    addRequested = Signal(bool)
    """Emitted with whether the mode shall have a colour that stands out."""

    def __init__(self, place: str) -> None:
        super().__init__()
        self.setText("Add")
        self.setToolTip(
            f"Add a mode at {place}: with the listed opacity and the colour of the TF there"
        )
        # After a click, keys such as R are the window's again.
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.MenuButtonPopup)
        menu = QMenu(self)
        add_action(menu, "In a colour that stands out", partial(self.addRequested.emit, True))
        self.setMenu(menu)
        self.clicked.connect(lambda: self.addRequested.emit(False))


HEIGHT, LOW_HEIGHT = 26, 24
"""Heights of a row, in pixels: usually, and where there is little room."""

BAR = 2


class PanelRow(QWidget):
    """A line of texts, and buttons that are drawn while the mouse or the focus is on the row.

    The first row of a list has its buttons while no other one is pointed at. By Tab all are
    reached, drawn or not.
    """

    def __init__(self, widths: Sequence[int], buttons: Sequence[QAbstractButton]) -> None:
        super().__init__()
        self._labels = [QLabel() if width else ElidedLabel() for width in widths]
        self._texts: Sequence[str] = ()
        self._buttons = list(buttons)
        self._siblings: Sequence[PanelRow] = (self,)
        self._share: float | None = None
        self._badge = ""
        self._row = row = QHBoxLayout(self)
        row.setContentsMargins(4, 0, 2, BAR)
        row.setSpacing(4)
        for label, width in zip(self._labels, widths, strict=True):
            label.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            if width:
                label.setMinimumWidth(width)
                row.addWidget(label)
            else:
                row.addWidget(label, 1)
        if all(widths):
            row.addStretch()
        for button in self._buttons:
            button.setFixedHeight(22)
            button.installEventFilter(self)
            row.addWidget(button)
        self.setFixedHeight(HEIGHT)

    @property
    def text(self) -> str:
        """What the row says; empty if it is not there."""
        words = [self._badge, *self._texts]
        return "" if self.isHidden() else "   ".join(word for word in words if word)

    @property
    def is_pointed_at(self) -> bool:
        """Whether the mouse or the focus is on it."""
        return self.underMouse() or any(button.hasFocus() for button in self._buttons)

    @property
    def is_lit(self) -> bool:
        """Whether its buttons are drawn."""
        pointed = [row for row in self._siblings if row.is_pointed_at]
        return self in pointed if pointed else self is self._siblings[0]

    def set_siblings(self, rows: Sequence[PanelRow]) -> None:
        """Say which rows make up the list."""
        self._siblings = rows

    def say(
        self, texts: Sequence[str], tip: str, *, badge: str = "", share: float | None = None
    ) -> None:
        """Show texts, and before them a badge, or below them a bar as long as a share."""
        self._texts = texts
        for label, text in zip(self._labels, texts, strict=True):
            if isinstance(label, ElidedLabel):
                label.set_full_text(text)
            else:
                label.setText(text)
        self._badge, self._share = badge, share
        self._row.setContentsMargins(28 if badge else 4, 0, 2, BAR)
        self.setToolTip(tip)
        self.setAccessibleName(" ".join(texts))
        self.show()
        self.update()

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Draw the buttons only while the row is lit."""
        kind = event.type()
        if kind in (QEvent.Type.FocusIn, QEvent.Type.FocusOut):
            self._update_all()
        return kind == QEvent.Type.Paint and not self.is_lit

    def enterEvent(self, event: QEnterEvent) -> None:
        """Light the row."""
        super().enterEvent(event)
        self._update_all()

    def leaveEvent(self, event: QEvent) -> None:
        """Let the row be as the others."""
        super().leaveEvent(event)
        self._update_all()

    def _update_all(self) -> None:
        for row in self._siblings:
            row.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint ground, badge and bar."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        if self.is_lit:
            painter.setBrush(QColor(theme.FIELD))
            painter.drawRoundedRect(QRectF(self.rect()), 4, 4)
        if self._badge:
            painter.setBrush(QColor(theme.CHANGE if self.isEnabled() else theme.FAINT_TEXT))
            box = QRectF(4, (self.height() - 18) / 2, 18, 18)
            painter.drawRoundedRect(box, 3, 3)
            painter.setPen(QColor(theme.BACKGROUND))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, self._badge)
        if self._share is not None:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.VISIBLE))
            length = self._share * self.width()
            painter.drawRect(QRectF(0, self.height() - BAR, length, BAR))
