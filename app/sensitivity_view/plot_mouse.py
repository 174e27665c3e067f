"""The mouse over the opacity plot: which value it asks about, and whether it drags a band."""

from __future__ import annotations

from typing import cast

from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent

from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.handle import DragHandle
from app.tf_editor.plot_area import PlotArea

CLICK_REACH = 4


class PlotMouse(QObject):
    """Asks by the mouse over the opacity plot; the handles get their events as always.

    Hovering shows where the value under the mouse is visible, and with Ctrl what an edit there
    would change; the wheel sets the edits' width,
    and dragging next to the handles pins a band of values, which a click there releases.
    """

    def __init__(self, area: PlotArea, state: ViewerState, asked: SensitivityState) -> None:
        super().__init__(area)
        self._area, self._state, self._asked = area, state, asked
        self._pressed: QPointF | None = None
        self._edits = False
        """Whether a handle was moved since the mouse came to the plot."""
        viewport = area.widget.viewport()
        viewport.setMouseTracking(True)
        viewport.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the mouse, and leave its events to the plot."""
        kind = event.type()
        if not self._asked.choices.shown:
            self._pressed = None
            return False
        if kind == QEvent.Type.Leave:
            self._edits = False
            self._asked.hover(None)
        elif kind == QEvent.Type.Wheel:
            wheel = cast(QWheelEvent, event)
            position = wheel.position()
            # With Ctrl, the wheel zooms the plots' axis.
            zooms = bool(wheel.modifiers() & Qt.KeyboardModifier.ControlModifier)
            if not zooms and self._value_at(position) is not None:
                self._asked.widen(wheel.angleDelta().y() / 120)
                return True
        elif kind == QEvent.Type.MouseButtonPress:
            mouse = cast(QMouseEvent, event)
            left = mouse.button() == Qt.MouseButton.LeftButton
            # With Shift, a drag selects handles.
            plain = left and not mouse.modifiers() & Qt.KeyboardModifier.ShiftModifier
            self._edits = self._is_over_handle(mouse.position())
            self._pressed = mouse.position() if plain and not self._edits else None
            if self._edits:
                self._asked.hover(None)
        elif kind == QEvent.Type.MouseMove:
            self._move(cast(QMouseEvent, event))
        elif kind == QEvent.Type.MouseButtonRelease:
            if self._asked.dragging and self._pressed is not None:
                self._asked.finish_band()
            elif self._pressed is not None:
                # A click next to the handles.
                self._asked.unpin()
                self._asked.hover(
                    self._value_at(self._pressed), _asks_effect(cast(QMouseEvent, event))
                )
            self._pressed = None
        return False

    def _move(self, event: QMouseEvent) -> None:
        value = self._value_at(event.position())
        if not event.buttons():
            # Who has just moved a handle, or is about to, looks at the picture.
            is_editing = self._edits or self._is_over_handle(event.position())
            self._asked.hover(None if is_editing else value, _asks_effect(event))
        elif self._pressed is not None:
            start = self._value_at(self._pressed)
            moved = abs(event.position().x() - self._pressed.x()) > CLICK_REACH
            if start is not None and value is not None and moved:
                self._asked.drag_band(start, value, _asks_effect(event))

    def _value_at(self, position: QPointF) -> float | None:
        """Scalar value under the mouse; None outside the opacity plot."""
        at = self._area.widget.mapToScene(position.toPoint())
        if not self._area.opacity.sceneBoundingRect().contains(at):
            return None
        place = self._area.opacity.mapSceneToView(at).x()
        lo, hi = self._state.scalar_range
        return min(max(self._area.axis.value(min(max(place, 0.0), 1.0)), lo), hi)

    def _is_over_handle(self, position: QPointF) -> bool:
        items = self._area.widget.items(position.toPoint())
        return any(isinstance(item, DragHandle) and item.isVisible() for item in items)


def _asks_effect(event: QMouseEvent) -> bool:
    """Whether the mouse asks what an edit would change, instead of where values are visible."""
    return bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
