"""Zoom and pan of the plots' scalar axis by the mouse."""

from __future__ import annotations

from typing import cast

from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent

from app.tf_editor.plot_area import PlotArea

ZOOM_STEP = 1.25
"""Factor of the visible interval by one step of the wheel."""


class AxisGestures(QObject):
    """Zooms the axis by Ctrl and the wheel, and pans it by drags with the middle button."""

    def __init__(self, area: PlotArea) -> None:
        super().__init__(area)
        self._area = area
        self._grip: float | None = None
        area.widget.viewport().installEventFilter(self)

    def zoom(self, steps: float, place: float = 0.5) -> None:
        """Zoom in by a number of steps, out by a negative one, around a place of the plots."""
        axis = self._area.axis
        self._area.set_axis(axis.zoomed(ZOOM_STEP**steps, min(max(place, 0.0), 1.0)))

    def show_all(self) -> None:
        """Show all values of the volume and of the TF's range."""
        axis = self._area.axis
        self._area.set_axis(axis.showing(axis.full))

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Take the wheel with Ctrl, and the middle button."""
        kind = event.type()
        if kind == QEvent.Type.Wheel:
            wheel = cast(QWheelEvent, event)
            if wheel.modifiers() & Qt.KeyboardModifier.ControlModifier:
                self.zoom(wheel.angleDelta().y() / 120, self._place(wheel.position()))
                return True
        elif kind in (QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonDblClick):
            mouse = cast(QMouseEvent, event)
            if mouse.button() == Qt.MouseButton.MiddleButton:
                self._grip = self._place(mouse.position())
                return True
        elif kind == QEvent.Type.MouseMove and self._grip is not None:
            place = self._place(cast(QMouseEvent, event).position())
            self._area.set_axis(self._area.axis.shifted(self._grip - place))
            self._grip = place
            return True
        elif (
            kind == QEvent.Type.MouseButtonRelease
            and self._grip is not None
            and cast(QMouseEvent, event).button() == Qt.MouseButton.MiddleButton
        ):
            self._grip = None
            return True
        return False

    def _place(self, position: QPointF) -> float:
        at = self._area.widget.mapToScene(position.toPoint())
        return float(self._area.opacity.mapSceneToView(at).x())
