"""Events as a mouse sends them."""

from PySide6.QtCore import QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QAction, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def action(window, text):
    """A window's action by its text in a menu."""
    (found,) = [a for a in window.findChildren(QAction) if a.text().replace("&", "") == text]
    return found


def box_of(widget, parent):
    return QRect(widget.mapTo(parent, QPoint()), widget.size())


def pixel(editor, value, height):
    """A place of the editor's opacity plot."""
    at = QPointF(editor.area.axis.place(value), height)
    return editor.area.widget.mapFromScene(editor.area.opacity.mapViewToScene(at))


def at(canvas, x, y):
    """A place of an image, in fractions of its middle square."""
    rect = canvas.image_rect
    return QPoint(round(rect.left() + x * rect.width()), round(rect.top() + y * rect.height()))


def drag(widget, *points, button=LEFT, keys=NONE):
    QTest.mousePress(widget, button, keys, points[0])
    for point in points[1:]:
        QTest.mouseMove(widget, point)
    QTest.mouseRelease(widget, button, keys, points[-1])


def wheel(widget, at, notches=0.0, *, pixels=0, keys=NONE):
    """Turn a wheel, or scroll a touchpad, which sends pixels."""
    event = QWheelEvent(
        at, widget.mapToGlobal(at), QPoint(0, pixels), QPoint(0, round(120 * notches)),
        Qt.MouseButton.NoButton, keys, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(widget, event)
