"""A chip: the name of a layer of the plot with its colour, dim while the layer is off."""

from __future__ import annotations

from typing import Literal

from PySide6.QtCore import QEvent, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap
from PySide6.QtWidgets import QToolButton

from app import theme

_ICON = QSize(14, 12)
AROUND = 18
"""Beside and between a chip's colour and its text, in pixels."""

_Form = Literal["line", "area", "region"]


class Chip(QToolButton):
    """A layer's name and its colour, as line or area; off it is dim.

    Parameters
    ----------
    form : {"line", "area", "region"}
    """

    def __init__(self, name: str, form: _Form, tip: str) -> None:
        super().__init__()
        self._form = form
        self._is_on = True
        self._caption = name
        self.setProperty("role", "chip")
        self.setAccessibleName(name)
        self.setToolTip(tip)
        self.setFixedHeight(24)
        self.setIconSize(_ICON)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        # After a click, keys such as W are the window's again.
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.set_caption(name)

    @property
    def caption(self) -> str:
        """Its text, also where there is no room for it."""
        return self._caption

    def set_caption(self, text: str) -> None:
        """Say another text."""
        self._caption = text
        self.set_folded(self.toolButtonStyle() == Qt.ToolButtonStyle.ToolButtonIconOnly)

    def set_folded(self, folded: bool) -> None:
        """Show the colour alone, or with the text."""
        style = Qt.ToolButtonStyle
        self.setToolButtonStyle(
            style.ToolButtonIconOnly if folded else style.ToolButtonTextBesideIcon
        )
        self.setText(f" {self._caption}")
        self._draw()

    def sizeHint(self) -> QSize:
        """Return the room of colour and text, of which Qt's style takes more than it fills."""
        hint = super().sizeHint()
        if self.toolButtonStyle() == Qt.ToolButtonStyle.ToolButtonIconOnly:
            return hint
        text = self.fontMetrics().horizontalAdvance(self.text())
        return QSize(min(_ICON.width() + text + AROUND, hint.width()), hint.height())

    def minimumSizeHint(self) -> QSize:
        """Return the same."""
        return self.sizeHint()

    def set_on(self, on: bool) -> None:
        """Look as if the layer is shown, or not."""
        self._is_on = on
        self.setProperty("off", not on)
        self.style().unpolish(self)
        self.style().polish(self)
        if self.isCheckable():
            self.setChecked(on)
        self._draw()

    def changeEvent(self, event: QEvent) -> None:
        """Take the colours of another theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self._draw()
        super().changeEvent(event)

    def _draw(self) -> None:
        colors = {"line": theme.CHANGE, "area": self._area_color, "region": theme.CHANGE}
        color = QColor(colors[self._form])
        ratio = self.devicePixelRatioF()
        picture = QPixmap(_ICON * ratio)
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not self._is_on:
            painter.setOpacity(0.45)
        if self._form == "line":
            painter.fillRect(QRectF(0, 5, 14, 2), color)
        elif self._form == "area":
            painter.setPen(QPen(color, 1))
            painter.setBrush(color if self._is_on else Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(QRectF(1, 1.5, 12, 9), 2, 2)
        else:
            pen = QPen(color, 1.4, Qt.PenStyle.DashLine)
            pen.setDashPattern([2, 1.4])
            painter.setPen(pen)
            painter.drawRoundedRect(QRectF(1, 1.5, 12, 9), 2, 2)
        painter.end()
        self.setIcon(QIcon(picture))

    @property
    def _area_color(self) -> str:
        return theme.VISIBLE if self.accessibleName() == "Visible" else theme.FAINT_TEXT
