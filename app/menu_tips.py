"""Tooltips of menu entries: next to the menu, where they hide no entry."""

from __future__ import annotations

import html

from PySide6.QtCore import QEvent, QObject, QPoint
from PySide6.QtGui import QHelpEvent, QTextDocument
from PySide6.QtWidgets import QMenu, QToolTip

QT_SHIFT = QPoint(2, 16)
"""By how much Qt shows a tooltip next to the place that it is given, in pixels."""

GAP, WIDTH = 6, 320
"""Distance to the menu, and width of a tooltip at most, in pixels."""


class _MenuTips(QObject):
    """Shows the tooltips of one menu."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Show the tooltip of the entry under the mouse, instead of Qt."""
        if not (isinstance(watched, QMenu) and isinstance(event, QHelpEvent)):
            return False
        if event.type() != QEvent.Type.ToolTip:
            return False
        action = watched.actionAt(event.pos())
        tip = "" if action is None else action.toolTip()
        # Without one of its own, an action's tooltip is its text.
        if action is None or not tip or tip == _plain(action.text()):
            QToolTip.hideText()
            return True
        text, width = _wrapped(tip)
        entry = watched.actionGeometry(action)
        place = watched.mapToGlobal(QPoint(watched.width() + GAP, entry.top()))
        if place.x() + width > watched.screen().availableGeometry().right():
            place = watched.mapToGlobal(QPoint(-GAP - width, entry.top()))
        QToolTip.showText(place - QT_SHIFT, text, watched, entry)
        return True


def show_tips(menu: QMenu) -> None:
    """Have a menu show its entries' tooltips, at its left where its right has no room."""
    menu.setToolTipsVisible(True)
    menu.installEventFilter(_MenuTips(menu))


def _wrapped(tip: str) -> tuple[str, int]:
    """Return a plain or rich tooltip as rich text that is wrapped, and its width in pixels."""
    inside = tip if tip.startswith("<") else html.escape(tip)
    document = QTextDocument()
    document.setDefaultFont(QToolTip.font())
    document.setHtml(inside)
    # Of the document, the frame and the style sheet.
    margins = 24
    width = round(min(document.idealWidth(), WIDTH))
    return f"<table width={width}><tr><td>{inside}</td></tr></table>", width + margins


def _plain(text: str) -> str:
    """Return an entry's text as Qt makes a tooltip of it: without key marks and dots."""
    return text.replace("&", "").partition("\t")[0].rstrip(".…")
