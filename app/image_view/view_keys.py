"""Keys that change the view while an image has the focus."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import cast

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget

from app.image_view.keyed_widget import ARROWS
from app.image_view.view_steps import DEGREES_PER_PIXEL, pan, roll, turn, zoom
from app.state.viewer_state import ViewerState
from model.scene.view import View

DEGREES, FINE_DEGREES = 5.0, 1.0
"""Step of a turn or roll, and with Shift."""

PAN_STEP, FINE_PAN_STEP = 0.1, 0.02
"""Step of a pan in halves of the image's shorter side, and with Shift."""

NOTCHES: dict[int, int] = {Qt.Key.Key_Plus: 1, Qt.Key.Key_Equal: 1, Qt.Key.Key_Minus: -1}
ROLLS: dict[int, int] = {Qt.Key.Key_PageUp: -1, Qt.Key.Key_PageDown: 1}
"""Clockwise turns of the image."""


class ViewKeys(QObject):
    """Changes a state's view by the keys of a widget, which a click, the wheel and tab focus.

    A key that is held repeats as a drag: live until it is released.
    """

    def __init__(self, widget: QWidget, state: ViewerState) -> None:
        super().__init__(widget)
        self._state = state
        self._held: set[int] = set()
        widget.setFocusPolicy(Qt.FocusPolicy.WheelFocus)
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle the keys of the view; pass on all others."""
        kind = event.type()
        if kind == QEvent.Type.ShortcutOverride and self._step(cast(QKeyEvent, event)):
            # The image has the focus, so it gets the key before the window's shortcuts.
            event.accept()
            return True
        if kind == QEvent.Type.KeyPress:
            return self._press(cast(QKeyEvent, event))
        if kind == QEvent.Type.KeyRelease:
            return self._release(cast(QKeyEvent, event))
        if kind in (QEvent.Type.FocusOut, QEvent.Type.Hide) and self._held:
            # The release goes to another widget.
            self._held.clear()
            self._state.finish_view()
        return False

    def _press(self, event: QKeyEvent) -> bool:
        change = self._step(event)
        if change is None:
            return False
        self._held.add(_place_of(event))
        self._state.move_view(change())
        return True

    def _release(self, event: QKeyEvent) -> bool:
        place = _place_of(event)
        if place not in self._held:
            return False
        if not event.isAutoRepeat():
            self._held.remove(place)
            if not self._held:
                self._state.finish_view()
        return True

    def _step(self, event: QKeyEvent) -> Callable[[], View] | None:
        """Change of a key, with its modifiers; None for others."""
        # The keys of the number block count as the others.
        keys = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        fine = bool(keys & Qt.KeyboardModifier.ShiftModifier)
        control = bool(keys & Qt.KeyboardModifier.ControlModifier)
        if keys & ~(Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier):
            return None
        state, key = self._state, event.key()
        if key in ARROWS:
            right, down = ARROWS[key]
            if control:
                length = FINE_PAN_STEP if fine else PAN_STEP
                return partial(pan, state.view, length * right, -length * down)
            pixels = (FINE_DEGREES if fine else DEGREES) / DEGREES_PER_PIXEL
            return partial(turn, state, pixels * right, pixels * down)
        if control:
            return None
        if key in NOTCHES:
            return partial(zoom, state.view, NOTCHES[key])
        if key in ROLLS:
            degrees = ROLLS[key] * (FINE_DEGREES if fine else DEGREES)
            return partial(roll, state.view, degrees)
        if key == Qt.Key.Key_Home:
            return lambda: state.home
        return None


def _place_of(event: QKeyEvent) -> int:
    """Place of a key on the keyboard: without Shift, the same key may have another name."""
    return event.nativeScanCode() or event.key()
