"""Events on an editor of TFs, as a mouse and a keyboard send them."""

from __future__ import annotations

import mouse_events
from mouse_events import LEFT, NONE
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest

from app.tf_editor.editor import TransferFunctionEditor


def pixel(editor: TransferFunctionEditor, value: float, height: float) -> QPoint:
    """Pixel of a value and a height of the opacity plot."""
    at = QPointF(editor.area.axis.place(value), height)
    return editor.area.widget.mapFromScene(editor.area.opacity.mapViewToScene(at))


def click(editor: TransferFunctionEditor, at: QPoint, modifier: Qt.KeyboardModifier = NONE) -> None:
    QTest.mouseClick(editor.area.widget.viewport(), LEFT, modifier, at)


def double_click(editor: TransferFunctionEditor, at: QPoint) -> None:
    """Click twice as a mouse does it: the second press comes as a double click."""
    viewport = editor.area.widget.viewport()
    QTest.mouseClick(viewport, LEFT, pos=at)
    QTest.mouseDClick(viewport, LEFT, pos=at)
    QTest.mouseRelease(viewport, LEFT, pos=at)


def drag(
    editor: TransferFunctionEditor,
    start: QPoint,
    end: QPoint,
    modifier: Qt.KeyboardModifier = NONE,
    button: Qt.MouseButton = LEFT,
) -> None:
    half = (start + end) / 2
    mouse_events.drag(editor.area.widget.viewport(), start, half, end, button=button, keys=modifier)
