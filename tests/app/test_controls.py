import pytest
from PySide6.QtCore import QEvent, QPoint
from PySide6.QtGui import QHelpEvent
from PySide6.QtWidgets import QApplication, QMenu, QToolTip

from app.controls import show_tips
from app.theme import apply_theme

LONG = "A sentence that says rather much about an entry, and that is wrapped where it is too long"


def ask(menu, number):
    """Rest with the mouse on an entry."""
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
