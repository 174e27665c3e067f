"""Mouse events over the images and the opacity plot, for tests of sensitivities."""

from mouse_events import pixel
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication


def hover(window, value, effect=True):
    """Move the mouse to a value, with Ctrl for what an edit there would change."""
    viewport, at = window.editor.area.widget.viewport(), pixel(window.editor, value, 0.8)
    none, keys = Qt.MouseButton.NoButton, Qt.KeyboardModifier
    keys = keys.ControlModifier if effect else keys.NoModifier
    event = QMouseEvent(QEvent.Type.MouseMove, at, viewport.mapToGlobal(at), none, none, keys)
    QApplication.sendEvent(viewport, event)


def asked(builders, kind):
    return [request for request in builders.analysts[-1].others if type(request) is kind]
