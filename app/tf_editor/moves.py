"""Moves of the selected handles, each drag and each nudge as one undo step."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QObject

from app.state.viewer_state import ViewerState
from app.tf_editor.selection import Kind, Selected, Selection
from model.scene import tf_editing as edits
from model.scene.transfer_function import OpacityTF, TransferFunction


class HandleMoves(QObject):
    """Moves and removes the selected handles of the state's TF together.

    Attributes
    ----------
    colors_follow : bool
        Whether a colour stop at the mean of a mode moves along with it.
    """

    def __init__(
        self, state: ViewerState, selection: Selection, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._selection = selection
        self._start: TransferFunction | None = None
        self._clicked: Selected | None = None
        self.colors_follow = True

    def press(self, kind: Kind, index: int, *, adds: bool = False) -> None:
        """Select the handle pressed, with the others or alone, and remember the TF."""
        if adds:
            self._selection.toggle(kind, index)
        elif index not in self._selection.indices(kind):
            self._selection.select(kind, index)
        else:
            # One of several: they stay selected, so that they can be dragged together.
            others = (i for i in self._selection.indices(kind) if i != index)
            self._selection.select_all(kind, (*others, index))
        self._clicked = None if adds else Selected(kind, index)
        self._start = self._state.transfer_function

    def drag(self, kind: Kind, index: int, value: float, height: float = 0.0) -> None:
        """Preview the selected handles moved as one of them is, to a value and an opacity."""
        start = self._start
        if start is None or index not in self._selection.indices(kind):
            return
        if kind == "opacity":
            at = edits.opacity_handles(start.opacity)[index]
            self._state.tf_input.move(self._moved(start, value - at[0], height - at[1]))
        else:
            self._state.tf_input.move(self._moved(start, value - start.color.stops[index][0], 0.0))

    def finish(self, text: str) -> None:
        """End a drag: one undo step. A click without a drag selects its handle alone."""
        if self._clicked is not None and not self._state.live:
            self._selection.select(self._clicked.kind, self._clicked.index)
        self._start = self._clicked = None
        self._state.tf_input.finish(text)

    def nudge(self, shift: float, lift: float) -> None:
        """Move the selected handles by a difference in value and in opacity."""
        selected = self._selection.selected
        if selected is not None:
            tf = self._moved(self._state.transfer_function, shift, lift)
            indices = self._selection.indices(selected.kind)
            self._state.tf_input.set(tf, "nudge", f"nudge {selected.kind} {indices}")

    def resize(self, index: int, width: float) -> None:
        """Set the width of a mode."""
        tf = self._state.transfer_function
        opacity = edits.resize_mode(tf.opacity, index, width)
        self._state.tf_input.set(replace(tf, opacity=opacity), "width", f"nudge width {index}")

    def remove(self) -> None:
        """Remove the selected handles, all but the ends of a free curve and of the colours."""
        tf, selected = self._state.transfer_function, self._selection.selected
        if selected is None:
            return
        indices = self._selection.indices(selected.kind)
        opacity, color = tf.opacity, tf.color
        for index in reversed(indices):
            if selected.kind == "opacity":
                opacity = edits.remove_opacity_handle(opacity, index)
            else:
                color = edits.remove_stop(color, index)
        after = TransferFunction(opacity, color)
        if after != tf:
            self._selection.clear()
            name = handle_name(opacity) if selected.kind == "opacity" else "colour stop"
            self._state.tf_input.set(after, f"remove {name}" + ("s" if len(indices) > 1 else ""))

    def with_opacity(self, before: TransferFunction, opacity: OpacityTF) -> TransferFunction:
        """Return a TF with its modes moved, and with their colours where these follow."""
        if self.colors_follow:
            return edits.follow_modes(before, opacity)
        return replace(before, opacity=opacity)

    def _moved(self, tf: TransferFunction, shift: float, lift: float) -> TransferFunction:
        modes = self._selection.indices("opacity")
        if modes:
            return self.with_opacity(tf, edits.move_opacity_handles(tf.opacity, modes, shift, lift))
        stops = self._selection.indices("color")
        return replace(tf, color=edits.move_stops(tf.color, stops, shift))


def handle_name(opacity: OpacityTF) -> str:
    """Return the name of this TF's handles, "mode" or "point"."""
    return "point" if opacity.points else "mode"
