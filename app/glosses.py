"""Terms of the window, each with a sentence that explains it, and the glossary."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtGui import QCursor, QTextDocument
from PySide6.QtWidgets import QDialog, QLabel, QTextBrowser, QToolTip, QVBoxLayout, QWidget

from app import theme
from app.controls import SearchField, close_box, fill

GLOSSARY = Path(__file__).parent.parent / "docs" / "glossary.md"

WIDTH, MARGIN = 620, (60, 90)  # width of the text of pages, and the room around it, in pixels
TITLE_BAR = 40  # height of a window's title bar, in pixels

SENTENCES = {
    "Other light": (
        "Path-traced light has no derivative. Curves are those of the unlit image (cosine .96 to "
        ".99), fields those of soft light (cosine .92)."
    ),
    "Learned": "The derivative of the model's image, as accurate as the model.",
    "Cosine": (
        "How well the shapes of the learned and the exact curve agree: 1 is perfect, 0 is not at "
        "all."
    ),
    "RMSE": "Root mean squared difference of pixels and colours: 0 of equal images, at most 1.",
}
"""One sentence for each term; the terms are those of the glossary."""


def gloss(term: str) -> str:
    """Return a term as a link of rich text."""
    assert term in SENTENCES
    style = f"color: {theme.TEXT}; text-decoration: underline"
    return f"<a href='{term}' style='{style}'>{term.lower()}</a>"


def without_links(text: str) -> str:
    """Return a rich text as plain text."""
    return re.sub(r"<[^>]*>", "", text).replace("&nbsp;", " ")


def explain(label: QLabel) -> None:
    """Make a label's terms show their meaning under the mouse, and open the glossary on a click."""
    label.linkHovered.connect(partial(_show_sentence, label))
    label.linkActivated.connect(lambda term: open_glossary(label.window(), term))


def open_glossary(parent: QWidget, term: str = "") -> QDialog:
    """Open the glossary, at a term if one is given, with a search field."""
    # The window itself is there, so that its picture is not needed.
    text = re.sub(r"!\[.*\n", "", GLOSSARY.read_text(encoding="utf-8"))
    entries = re.split(r"\n(?=\S)", text)

    def found(words: str) -> str:
        shown = [e for e in entries if all(word in e.lower() for word in words.lower().split())]
        return "\n".join(shown) or "No entry has these words."

    page, dialog = open_page(parent, "Glossary", text, "Search the glossary", found)
    if term:
        # From the end, so that the term is at the top.
        page.moveCursor(page.textCursor().MoveOperation.End)
        cursor = page.document().find(f"{term}.", 0, QTextDocument.FindFlag.FindCaseSensitively)
        if not cursor.isNull():
            page.setTextCursor(cursor)
    return dialog


def open_page(
    parent: QWidget, title: str, text: str, search: str = "", found: Callable[[str], str] = str
) -> tuple[QTextBrowser, QDialog]:
    """Open a page of HTML or Markdown, as high as its text or its parent.

    With the name of a search field, it shows what a function finds for the typed words.
    """
    dialog = QDialog(parent)
    dialog.setWindowTitle(title)
    page = QTextBrowser(openExternalLinks=True)
    show = page.setHtml if text.startswith("<") else page.setMarkdown
    show(text)
    parts = page, close_box(dialog)
    column = fill(QVBoxLayout(dialog), *parts, margins=(9, 9, 9, 9), spacing=6)
    if search:
        field = SearchField(search)
        field.textChanged.connect(lambda words: show(found(words)))
        column.insertWidget(0, field)
        field.setFocus()
    page.document().setTextWidth(WIDTH)
    height = round(page.document().size().height()) + MARGIN[1]
    # With a title bar it is no higher than the window.
    dialog.resize(WIDTH + MARGIN[0], min(height, parent.window().height() - TITLE_BAR))
    dialog.open()
    return page, dialog


def _show_sentence(label: QLabel, term: str) -> None:
    # An empty text hides the tooltip.
    text = f"{term}: {SENTENCES[term]}\nClick: glossary" if term else ""
    QToolTip.showText(QCursor.pos(), text, label)
