import re

import pytest
from PySide6.QtGui import QColor, QPalette
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QLineEdit, QTextBrowser, QToolTip

from app import theme
from app.controls import picture_icon
from app.glosses import GLOSSARY, SENTENCES, explain, gloss, without_links
from app.theme import DARK, LIGHT, apply_theme


def luminance(color):
    """Relative luminance of WCAG 2."""
    parts = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("colors", [DARK, LIGHT], ids=["dark", "light"])
def test_every_text_can_be_read_on_every_ground(colors):
    # Disabled text carries no meaning.
    for ink in ("text", "dim", "change", "visible", "attention", "error"):
        for ground in ("window", "panel", "field", "plot"):
            assert contrast(getattr(colors, ink), getattr(colors, ground)) >= 4.5, (ink, ground)
    # What is chosen in a menu, and what is pressed.
    assert contrast(colors.window, colors.change) >= 4.5
    assert contrast(colors.text, colors.pressed) >= 4.5


def test_the_names_follow_the_theme(qapp):
    try:
        apply_theme(qapp, "light")
        assert LIGHT.text == theme.TEXT and LIGHT.panel == theme.PANEL
        assert theme.present() is LIGHT
        assert qapp.palette().color(QPalette.ColorRole.Window) == QColor(LIGHT.window)
        # What lies over an image is dark in both; so are words in place of one.
        assert theme.ON_IMAGE is DARK
        bright = picture_icon(None, 96).pixmap(96).toImage()
    finally:
        apply_theme(qapp, "dark")
    assert theme.present() is DARK
    assert picture_icon(None, 96).pixmap(96).toImage() == bright


def test_every_term_is_in_the_glossary_and_has_one_sentence():
    headings = re.findall(r"\*\*(.+?)\.\*\*", GLOSSARY.read_text(encoding="utf-8"))
    assert set(SENTENCES) <= set(headings)
    assert all(sentence.endswith(".") for sentence in SENTENCES.values())


@pytest.mark.parametrize("term", SENTENCES)
def test_a_term_says_what_it_means_and_leads_to_the_glossary(qtbot, term):
    label = QLabel(f"It is {gloss(term)}, 0.9")
    qtbot.addWidget(label)
    explain(label)
    label.show()
    assert without_links(label.text()) == f"It is {term.lower()}, 0.9"
    label.linkHovered.emit(term)
    assert SENTENCES[term] in QToolTip.text()
    label.linkHovered.emit("")
    label.linkActivated.emit(term)
    (page,) = label.findChildren(QTextBrowser)
    assert page.textCursor().selectedText() == f"{term}."
    assert "\ufffc" not in page.toPlainText()  # an icon for a missing picture
    (search,) = page.window().findChildren(QLineEdit)
    QTest.keyClicks(search, "bell opacity")
    assert page.toPlainText().count(".\n") <= 2 and page.toPlainText().startswith("Mode.")
    search.clear()
    assert page.toPlainText().startswith("Glossary")
    page.window().close()
