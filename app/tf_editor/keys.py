"""Keys of the TF editor, active while its plots have the focus."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import cast

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent

from app.state.viewer_state import ViewerState
from app.tf_editor.axis_gestures import AxisGestures
from app.tf_editor.color_layer import ColorLayer
from app.tf_editor.moves import HandleMoves
from app.tf_editor.opacity_layer import OpacityLayer
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.selection import Kind, Selection
from model.scene import tf_editing as edits

_NUDGE_HEIGHT = 0.01
_BIG_NUDGE = 10
"""Number of small steps of an arrow key with Shift."""

NEW_HEIGHT = 0.3
"""Opacity of a mode or point added without the mouse."""

_Target = tuple[Kind, int, int | None]
"""Kind and index of a handle, and 0 or 1 for a flank of it."""


class EditorKeys(QObject):
    """Binds keys that reach, move, add and remove every handle."""

    def __init__(
        self,
        area: PlotArea,
        state: ViewerState,
        selection: Selection,
        moves: HandleMoves,
        opacity: OpacityLayer,
        color: ColorLayer,
        gestures: AxisGestures,
    ) -> None:
        super().__init__(area)
        self._area = area
        self._state = state
        self._selection = selection
        self._moves = moves
        self._opacity = opacity
        self._color = color
        none, shift = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier
        control = Qt.KeyboardModifier.ControlModifier
        key = Qt.Key
        self._slots: dict[tuple[int, Qt.KeyboardModifier], Callable[[], object]] = {
            (key.Key_Delete, none): moves.remove,
            (key.Key_Backspace, none): moves.remove,
            (key.Key_Return, none): self.choose_color,
            (key.Key_Enter, none): self.choose_color,
            (key.Key_Tab, none): partial(self.go, 1),
            (key.Key_Backtab, shift): partial(self.go, -1),
            (key.Key_Insert, none): self.add,
            (key.Key_Escape, none): selection.clear,
            (key.Key_A, control): self.select_all,
            (key.Key_Home, none): gestures.show_all,
            (key.Key_Plus, none): partial(gestures.zoom, 1),
            # On most keyboards, + is a shifted key.
            (key.Key_Plus, shift): partial(gestures.zoom, 1),
            (key.Key_Minus, none): partial(gestures.zoom, -1),
        }
        for arrow, right, up in (
            (key.Key_Left, -1, 0),
            (key.Key_Right, 1, 0),
            (key.Key_Up, 0, 1),
            (key.Key_Down, 0, -1),
        ):
            self._slots[arrow, none] = partial(self.nudge, right, up)
            big = partial(self.nudge, _BIG_NUDGE * right, _BIG_NUDGE * up)
            self._slots[arrow, shift] = big
        area.widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Take the keys before the window's shortcuts and before Tab leaves."""
        kind = event.type()
        if kind not in (QEvent.Type.ShortcutOverride, QEvent.Type.KeyPress):
            return False
        pressed = cast(QKeyEvent, event)
        modifiers = pressed.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        slot = self._slots.get((pressed.key(), modifiers))
        if slot is None:
            return False
        event.accept()
        if kind == QEvent.Type.KeyPress:
            slot()
        # Escape also ends what else is under way in the window.
        return pressed.key() != Qt.Key.Key_Escape

    def nudge(self, right: int, up: int) -> None:
        """Move the selected handles by bins of the range and hundredths of opacity.

        With a flank reached by Tab, the width of its mode changes instead.
        """
        opacity = self._state.transfer_function.opacity
        shift = right * opacity.bin_width
        index = self._selection.index("opacity")
        if self._selection.flank is None or index is None or opacity.points:
            self._moves.nudge(shift, up * _NUDGE_HEIGHT)
        elif right:
            outwards = shift if self._selection.flank == 1 else -shift
            self._moves.resize(index, opacity.modes[index].width + outwards)

    def go(self, step: int) -> None:
        """Go to the next or last handle; beyond the first and last one, out of the plots."""
        targets = self._targets()
        now = self._selection.selected
        if now is None:
            at = -1 if step > 0 else len(targets)
        else:
            at = targets.index((now.kind, now.index, self._selection.flank))
        if 0 <= at + step < len(targets):
            kind, index, flank = targets[at + step]
            self._selection.select(kind, index, flank)
        elif step > 0:
            self._area.widget.window().focusNextChild()
        else:
            self._area.widget.window().focusPreviousChild()

    def add(self) -> None:
        """Add a colour stop after the current one, or else a mode or point."""
        stop = self._selection.index("color")
        if stop is None:
            self.add_in_the_middle()
            return
        values = [s[0] for s in self._state.transfer_function.color.stops]
        first = min(stop, len(values) - 2)
        self._color.add((values[first] + values[first + 1]) / 2)

    def add_in_the_middle(self) -> None:
        """Add a mode or point in the middle of the part of the TF that is visible."""
        lo, hi = self._state.scalar_range
        first, last = self._area.axis.visible
        if max(lo, first) < min(hi, last):
            lo, hi = max(lo, first), min(hi, last)
        self._opacity.add((lo + hi) / 2, NEW_HEIGHT)

    def choose_color(self) -> None:
        """Open the colour of the current stop."""
        index = self._selection.index("color")
        if index is not None:
            self._color.choose_color(index)

    def select_all(self) -> None:
        """Select all handles of the current one's kind; all modes or points without one."""
        tf = self._state.transfer_function
        if self._selection.index("color") is not None:
            self._selection.select_all("color", range(len(tf.color.stops)))
        else:
            handles = edits.opacity_handles(tf.opacity)
            self._selection.select_all("opacity", range(len(handles)))

    def _targets(self) -> list[_Target]:
        """All handles in the order of Tab: modes with their flanks or points, then stops."""
        tf = self._state.transfer_function
        targets: list[_Target] = []
        for index in range(len(edits.opacity_handles(tf.opacity))):
            targets.append(("opacity", index, None))
            if not tf.opacity.points:
                targets += [("opacity", index, 0), ("opacity", index, 1)]
        return targets + [("color", index, None) for index in range(len(tf.color.stops))]
