"""Selection of several handles by a frame drawn with Shift."""

from __future__ import annotations

from typing import cast

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QSize, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QRubberBand

from app.tf_editor.color_layer import ColorLayer
from app.tf_editor.handle import DragHandle
from app.tf_editor.opacity_layer import OpacityLayer
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.selection import Selection


class RubberBand(QObject):
    """Selects the modes or points, or else the colour stops, in a frame drawn with Shift."""

    def __init__(
        self, area: PlotArea, opacity: OpacityLayer, color: ColorLayer, selection: Selection
    ) -> None:
        super().__init__(area)
        self._area = area
        self._opacity = opacity
        self._color = color
        self._selection = selection
        self._start: QPoint | None = None
        self._viewport = area.widget.viewport()
        self._frame = QRubberBand(QRubberBand.Shape.Rectangle, self._viewport)
        self._viewport.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Take drags with Shift that begin next to the handles."""
        kind = event.type()
        if kind == QEvent.Type.MouseButtonPress:
            mouse = cast(QMouseEvent, event)
            at = mouse.position().toPoint()
            shift = mouse.modifiers() == Qt.KeyboardModifier.ShiftModifier
            if shift and mouse.button() == Qt.MouseButton.LeftButton and not self._handle_at(at):
                self._start = at
                self._frame.setGeometry(QRect(at, QSize()))
                self._frame.show()
                self._area.widget.setFocus()
                return True
        elif kind == QEvent.Type.MouseMove and self._start is not None:
            at = cast(QMouseEvent, event).position().toPoint()
            self._frame.setGeometry(QRect(self._start, at).normalized())
            return True
        elif kind == QEvent.Type.MouseButtonRelease and self._start is not None:
            at = cast(QMouseEvent, event).position().toPoint()
            self._frame.hide()
            self._select(QRect(self._start, at).normalized())
            self._start = None
            return True
        return False

    def _select(self, frame: QRect) -> None:
        modes = self._inside(self._opacity.peaks, frame)
        if modes:
            self._selection.select_all("opacity", modes)
        else:
            self._selection.select_all("color", self._inside(self._color.stops, frame))

    def _inside(self, handles: tuple[DragHandle, ...], frame: QRect) -> list[int]:
        view = self._area.widget
        return [
            index
            for index, handle in enumerate(handles)
            if handle.isVisible() and frame.contains(view.mapFromScene(handle.scenePos()))
        ]

    def _handle_at(self, at: QPoint) -> bool:
        items = self._area.widget.items(at)
        return any(isinstance(item, DragHandle) and item.isVisible() for item in items)
