import re

import pytest
from PySide6.QtCore import QEvent, QPoint
from PySide6.QtGui import QColor, QHelpEvent, QPalette
from PySide6.QtWidgets import QApplication, QLabel, QMenu, QTextBrowser, QToolTip

from app import theme
from app.controls import show_tips
from app.glosses import GLOSSARY, SENTENCES, explain, gloss, without_links
from app.icons import icon, icon_names
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
        # What lies over an image is dark in both.
        assert theme.ON_IMAGE is DARK
    finally:
        apply_theme(qapp, "dark")
    assert theme.present() is DARK


@pytest.mark.parametrize("name", icon_names())
def test_an_icon_is_drawn_in_the_texts_colour(qapp, name):
    for colors in (DARK, LIGHT):
        image = icon(name, colors).pixmap(18, 18).toImage()
        # Antialiased lines of one colour: what is opaque has it.
        solid = {
            image.pixelColor(x, y).name()
            for x in range(image.width())
            for y in range(image.height())
            if image.pixelColor(x, y).alpha() == 255
        }
        assert solid <= {QColor(colors.text).name()}
        inked = sum(
            image.pixelColor(x, y).alpha() > 60
            for x in range(image.width())
            for y in range(image.height())
        )
        assert inked > 10


LONG = "A sentence that says rather much about an entry, and that is wrapped where it is too long"


def ask(menu, number):
    at = menu.actionGeometry(menu.actions()[number]).center()
    event = QHelpEvent(QEvent.Type.ToolTip, at, menu.mapToGlobal(at))
    QApplication.sendEvent(menu, event)


def tip_rect():
    (tip,) = [
        w for w in QApplication.topLevelWidgets() if w.metaObject().className() == "QTipLabel"
    ]
    return tip.frameGeometry()


@pytest.mark.parametrize("at_right", [False, True])
def test_a_tip_is_beside_its_menu_and_hides_no_entry(qapp, qtbot, at_right):
    apply_theme(qapp, "dark")
    menu = QMenu()
    qtbot.addWidget(menu)
    for name in ("One", "Another"):
        menu.addAction(name)
    menu.actions()[0].setToolTip(LONG)
    show_tips(menu)
    screen = menu.screen().availableGeometry()
    width = menu.sizeHint().width()
    menu.popup(QPoint(screen.right() - width - 5 if at_right else 40, 40))
    ask(menu, 0)
    assert LONG in QToolTip.text()
    tip, entry = tip_rect(), menu.geometry()
    assert not tip.intersects(entry)
    assert abs((entry.left() - tip.right()) if at_right else (tip.left() - entry.right())) < 36
    assert screen.contains(tip)
    # What says no more than the entry is not said.
    ask(menu, 1)
    qtbot.waitUntil(lambda: not QToolTip.isVisible())
    menu.close()


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
    label.linkHovered.emit(f"gloss:{term}")
    assert SENTENCES[term] in QToolTip.text()
    label.linkHovered.emit("")
    label.linkActivated.emit(f"gloss:{term}")
    (page,) = label.findChildren(QTextBrowser)
    assert page.textCursor().selectedText() == f"{term}."
    page.window().close()


def test_every_term_leads_to_the_glossary_where_it_stands():
    """No term has a sentence that nobody can reach: the source names each beside a link to it."""
    sources = [
        path.read_text(encoding="utf-8")
        for path in GLOSSARY.parents[1].glob("app/**/*.py")
        if path.name != "glosses.py"
    ]
    linked = [text for text in sources if re.search(r"\b(gloss|open_glossary)\(", text)]
    for term in SENTENCES:
        assert any(f'"{term}"' in text or f"'{term}'" in text for text in linked), term
