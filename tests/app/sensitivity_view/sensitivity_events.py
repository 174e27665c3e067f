"""Mouse events over the images and the opacity plot, for tests of sensitivities."""

from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication


def over_plot(window, value, height=0.8):
    area = window.editor.area
    place = QPointF(area.axis.place(value), height)
    return area.widget.mapFromScene(area.opacity.mapViewToScene(place))


def hover(window, value, effect=True):
    """Move the mouse to a value, with Ctrl for what an edit there would change."""
    viewport, at = window.editor.area.widget.viewport(), over_plot(window, value)
    none, keys = Qt.MouseButton.NoButton, Qt.KeyboardModifier
    keys = keys.ControlModifier if effect else keys.NoModifier
    event = QMouseEvent(QEvent.Type.MouseMove, at, viewport.mapToGlobal(at), none, none, keys)
    QApplication.sendEvent(viewport, event)


def asked(builders, kind):
    return [request for request in builders.analysts[-1].others if type(request) is kind]
