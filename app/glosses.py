"""Terms of the window with the sentence that says what each means, and the glossary behind them."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

from PySide6.QtGui import QCursor, QTextDocument
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QLabel,
    QTextBrowser,
    QToolTip,
    QVBoxLayout,
    QWidget,
)

from app import theme

GLOSSARY = Path(__file__).parent.parent / "docs" / "glossary.md"

SIZE = 620, 560
"""Of the glossary's window, in pixels."""

_PREFIX = "gloss:"

SENTENCES = {
    "Exact": "The exact derivative of the ray caster's image.",
    "Surrogate": (
        "Path-traced light has no derivative. Curves are those of the unlit image (cosine .96 to "
        ".99), fields those of soft light (cosine .92)."
    ),
    "Learned": "The derivative of the model's image, as accurate as the model.",
    "Cosine": (
        "How well the shapes of the learned and the exact curve agree: 1 is perfect, 0 is not at "
        "all."
    ),
    "RMSE": "Root mean squared error over all pixels and colours, from 0 to 1: smaller is better.",
}
"""One sentence for each term; the terms are those of the glossary."""


def gloss(term: str, text: str = "") -> str:
    """Return a term as a link of rich text, shown as it is or as another text."""
    assert term in SENTENCES
    style = f"color: {theme.TEXT}; text-decoration: underline"
    return f"<a href='{_PREFIX}{term}' style='{style}'>{text or term.lower()}</a>"


def without_links(text: str) -> str:
    """Return what is read of a rich text."""
    return re.sub(r"<[^>]*>", "", text).replace("&nbsp;", " ")


def explain(label: QLabel) -> None:
    """Have a label's terms say what they mean under the mouse, and open the glossary by a click."""
    label.linkHovered.connect(partial(_tell, label))
    label.linkActivated.connect(lambda link: open_glossary(label.window(), _term(link)))


def open_glossary(parent: QWidget, term: str = "") -> QDialog:
    """Open the glossary, at a term if one is given."""
    dialog = QDialog(parent)
    dialog.setWindowTitle("Glossary")
    page = QTextBrowser()
    page.setMarkdown(GLOSSARY.read_text(encoding="utf-8"))
    close = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
    close.rejected.connect(dialog.reject)
    column = QVBoxLayout(dialog)
    column.addWidget(page)
    column.addWidget(close)
    dialog.resize(*SIZE)
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
    if term:
        # From the end, so that the term comes to stand at the top.
        page.moveCursor(page.textCursor().MoveOperation.End)
        cursor = page.document().find(f"{term}.", 0, QTextDocument.FindFlag.FindCaseSensitively)
        if not cursor.isNull():
            page.setTextCursor(cursor)
    return dialog


def _tell(label: QLabel, link: str) -> None:
    term = _term(link)
    if term:
        QToolTip.showText(QCursor.pos(), f"{term}: {SENTENCES[term]}\nClick: glossary", label)
    else:
        QToolTip.hideText()


def _term(link: str) -> str:
    term = link.removeprefix(_PREFIX)
    return term if term in SENTENCES else ""
