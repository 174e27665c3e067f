import re

import pytest
from PySide6.QtWidgets import QLabel, QTextBrowser, QToolTip

from app.glosses import GLOSSARY, SENTENCES, explain, gloss, without_links


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
