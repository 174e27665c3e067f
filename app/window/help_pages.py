"""Pages of help in windows of their own."""

from __future__ import annotations

from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QLineEdit,
    QTextBrowser,
    QVBoxLayout,
    QWidget,
)

from app.window.gesture_table import help_text

TEXT_WIDTH = 620
"""Of the texts, in pixels."""

MARGIN = 60, 90
"""Of the page around its text, in pixels."""


def show_gestures(window: QWidget) -> QDialog:
    """Show all keys and gestures, to be searched."""
    wanted = QLineEdit()
    wanted.setPlaceholderText("Search")
    wanted.setAccessibleName("Search keys and gestures")
    wanted.setClearButtonEnabled(True)
    page, box = _page(window, "Keys and gestures", help_text(), wanted)
    wanted.textChanged.connect(lambda text: page.setHtml(help_text(text)))
    wanted.setFocus()
    return box


def show_page(window: QWidget, title: str, text: str) -> QDialog:
    """Show a page of rich text."""
    return _page(window, title, text)[1]


def _page(
    window: QWidget, title: str, text: str, above: QWidget | None = None
) -> tuple[QTextBrowser, QDialog]:
    box = QDialog(window)
    box.setWindowTitle(title)
    page = QTextBrowser()
    page.setHtml(text)
    page.setOpenExternalLinks(True)
    close = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
    close.rejected.connect(box.reject)
    column = QVBoxLayout(box)
    if above is not None:
        column.addWidget(above)
    column.addWidget(page)
    column.addWidget(close)
    # As high as its text, unless the window is lower: then it scrolls.
    page.document().setTextWidth(TEXT_WIDTH)
    height = round(page.document().size().height()) + MARGIN[1]
    box.resize(TEXT_WIDTH + MARGIN[0], min(height, window.height()))
    box.finished.connect(box.deleteLater)
    box.open()
    return page, box
