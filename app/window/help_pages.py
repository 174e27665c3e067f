"""Pages of help in windows of their own."""

from __future__ import annotations

from PySide6.QtWidgets import QDialog, QLineEdit, QWidget

from app.glosses import open_page
from app.window.gesture_table import help_text

ABOUT = """<h3>tfscope</h3>
<p>Volume rendering with transfer functions, next to a generative model of the
renderings.</p>
<p>After M. Berger, J. Li and J. A. Levine, <i>A Generative Model for Volume
Rendering</i>, IEEE TVCG 2018. The ground truth is rendered by VTK or by
 tfscope's own ray caster.</p>
<p>BSD 3-Clause licence.</p>"""


def show_gestures(window: QWidget) -> QDialog:
    """Show all keys and gestures, to be searched."""
    wanted = QLineEdit()
    wanted.setPlaceholderText("Search")
    wanted.setAccessibleName("Search keys and gestures")
    wanted.setClearButtonEnabled(True)
    page, dialog = open_page(window, "Keys and gestures", help_text(), wanted)
    wanted.textChanged.connect(lambda text: page.setHtml(help_text(text)))
    wanted.setFocus()
    return dialog


def show_about(window: QWidget) -> QDialog:
    """Show what tfscope is."""
    return open_page(window, "About tfscope", ABOUT)[1]
