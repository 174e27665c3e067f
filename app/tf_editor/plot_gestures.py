"""Mouse gestures on the plots: zoom and pan of the axis, and a frame that selects handles."""

from __future__ import annotations

from typing import cast

from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, QSize, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QRubberBand

from app.tf_editor.color_layer import ColorLayer
from app.tf_editor.handle import DragHandle
from app.tf_editor.moves import Selection
from app.tf_editor.opacity_layer import OpacityLayer
from app.tf_editor.plot_area import PlotArea


class PlotGestures(QObject):
    """Zooms the axis by Ctrl and the wheel, pans it by the middle button, selects with Shift.

    A frame drawn with Shift selects the modes or points in it, or else the colour stops.
    """

    def __init__(
        self, area: PlotArea, opacity: OpacityLayer, color: ColorLayer, selection: Selection
    ) -> None:
        super().__init__(area)
        self._area, self._opacity, self._color = area, opacity, color
        self._selection = selection
        self._grip: float | None = None
        self._start: QPoint | None = None
        viewport = area.widget.viewport()
        self._frame = QRubberBand(QRubberBand.Shape.Rectangle, viewport)
        viewport.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Take the gestures' events; pass on all others."""
        kind = event.type()
        if kind == QEvent.Type.Wheel:
            return self._zoom(cast(QWheelEvent, event))
        if kind in (QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonDblClick):
            return self._press(cast(QMouseEvent, event))
        if kind == QEvent.Type.MouseMove:
            return self._move(cast(QMouseEvent, event))
        if kind == QEvent.Type.MouseButtonRelease:
            return self._release(cast(QMouseEvent, event))
        return False

    def _zoom(self, event: QWheelEvent) -> bool:
        if not event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            return False
        self._area.zoom(event.angleDelta().y() / 120, self._place(event.position()))
        return True

    def _press(self, event: QMouseEvent) -> bool:
        if event.button() == Qt.MouseButton.MiddleButton:
            self._grip = self._place(event.position())
            return True
        at = event.position().toPoint()
        shift = event.modifiers() == Qt.KeyboardModifier.ShiftModifier
        is_press = event.type() == QEvent.Type.MouseButtonPress
        left = is_press and event.button() == Qt.MouseButton.LeftButton
        if not (shift and left) or self._is_handle_at(at):
            return False
        self._start = at
        self._frame.setGeometry(QRect(at, QSize()))
        self._frame.show()
        self._area.widget.setFocus()
        return True

    def _move(self, event: QMouseEvent) -> bool:
        if self._grip is not None:
            place = self._place(event.position())
            self._area.set_axis(self._area.axis.shifted(self._grip - place))
            self._grip = place
        elif self._start is not None:
            at = event.position().toPoint()
            self._frame.setGeometry(QRect(self._start, at).normalized())
        return self._grip is not None or self._start is not None

    def _release(self, event: QMouseEvent) -> bool:
        if self._grip is not None and event.button() == Qt.MouseButton.MiddleButton:
            self._grip = None
            return True
        if self._start is None:
            return False
        frame = QRect(self._start, event.position().toPoint()).normalized()
        self._frame.hide()
        self._start = None
        modes = self._inside(self._opacity.peaks, frame)
        if modes:
            self._selection.select_all("opacity", modes)
        else:
            self._selection.select_all("color", self._inside(self._color.stops, frame))
        return True

    def _inside(self, handles: list[DragHandle], frame: QRect) -> list[int]:
        view = self._area.widget
        return [
            index
            for index, handle in enumerate(handles)
            if handle.isVisible() and frame.contains(view.mapFromScene(handle.scenePos()))
        ]

    def _is_handle_at(self, at: QPoint) -> bool:
        items = self._area.widget.items(at)
        return any(isinstance(item, DragHandle) and item.isVisible() for item in items)

    def _place(self, position: QPointF) -> float:
        at = self._area.widget.mapToScene(position.toPoint())
        return float(self._area.opacity.mapSceneToView(at).x())
