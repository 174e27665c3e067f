"""Mouse events over the images and the opacity plot, for tests of sensitivities."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication
from window_fakes import FakeBuilders

from app.image_view.image_canvas import ImageCanvas
from app.window.main_window import MainWindow


def at(canvas: ImageCanvas, x: float, y: float) -> QPoint:
    """Position of a place of the image."""
    rect = canvas.image_rect
    return QPoint(round(rect.left() + x * rect.width()), round(rect.top() + y * rect.height()))


def over_plot(window: MainWindow, value: float, height: float = 0.8) -> QPoint:
    """Position of a value in the opacity plot."""
    area = window.editor.area
    place = QPointF(area.axis.place(value), height)
    return area.widget.mapFromScene(area.opacity.mapViewToScene(place))


def hover(window: MainWindow, value: float, effect: bool = True) -> None:
    """Move the mouse to a value, with Ctrl for what an edit there would change."""
    viewport, at = window.editor.area.widget.viewport(), over_plot(window, value)
    control, none = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.NoModifier
    QApplication.sendEvent(
        viewport,
        QMouseEvent(
            QEvent.Type.MouseMove, at, viewport.mapToGlobal(at), Qt.MouseButton.NoButton,
            Qt.MouseButton.NoButton, control if effect else none,
        ),
    )  # fmt: skip


def asked(builders: FakeBuilders, kind: type) -> list:
    return [request for request in builders.analysts[-1].others if type(request) is kind]
