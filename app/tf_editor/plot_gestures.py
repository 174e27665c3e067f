"""Mouse and keys on the plots: zoom, pan, frame selection, and keys for all handles."""

from collections.abc import Callable
from functools import partial
from typing import cast

from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, QSize, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QRubberBand

from app.controls import ARROWS
from app.tf_editor.handles import DragHandle, HandleMoves, Kind, Selection
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.tf_layers import ColorLayer, OpacityLayer
from model.scene import tf_editing as edits


class PlotGestures(QObject):
    """Zooms the axis with Ctrl and wheel, pans it with the middle button, selects with Shift."""

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
        """Handle the gestures' events; pass on all others."""
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
        if not (shift and left) or self._area.has_handle_at(at):
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
        if modes := self._inside(self._opacity.peaks, frame):
            self._selection.select("opacity", *modes)
        else:
            self._selection.select("color", *self._inside(self._color.stops, frame))
        return True

    def _inside(self, handles: list[DragHandle], frame: QRect) -> list[int]:
        view = self._area.widget
        return [
            index
            for index, handle in enumerate(handles)
            if handle.isVisible() and frame.contains(view.mapFromScene(handle.scenePos()))
        ]

    def _place(self, position: QPointF) -> float:
        at = self._area.widget.mapToScene(position.toPoint())
        return float(self._area.opacity.mapSceneToView(at).x())


_NUDGE_HEIGHT = 0.01
_BIG_NUDGE = 10  # number of small steps of an arrow key with Shift
NEW_HEIGHT = 0.3  # opacity of a mode or point added without the mouse


class EditorKeys(QObject):
    """Binds the keys that select, move, add and remove handles."""

    def __init__(self, area: PlotArea, moves: HandleMoves, color: ColorLayer) -> None:
        super().__init__(area)
        self._area, self._moves, self._selection = area, moves, moves.selection
        none, shift = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier
        control, key = Qt.KeyboardModifier.ControlModifier, Qt.Key
        self._slots: dict[tuple[int, Qt.KeyboardModifier], Callable[[], object]] = {
            (key.Key_Delete, none): moves.remove,
            (key.Key_Backspace, none): moves.remove,
            (key.Key_Return, none): color.choose_selected,
            (key.Key_Enter, none): color.choose_selected,
            (key.Key_Tab, none): partial(self._go, 1),
            (key.Key_Backtab, shift): partial(self._go, -1),
            (key.Key_Insert, none): self._add,
            (key.Key_Escape, none): moves.selection.clear,
            (key.Key_A, control): self._select_all,
            (key.Key_Home, none): area.show_all,
            (key.Key_Plus, none): partial(area.zoom, 1),
            # On most keyboards, + is a shifted key.
            (key.Key_Plus, shift): partial(area.zoom, 1),
            (key.Key_Minus, none): partial(area.zoom, -1),
        }
        for arrow, (right, down) in ARROWS.items():
            self._slots[arrow, none] = partial(self._nudge, right, -down)
            self._slots[arrow, shift] = partial(self._nudge, _BIG_NUDGE * right, -_BIG_NUDGE * down)
        area.widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Take the keys before the window's shortcuts and before Tab leaves the plots."""
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
        # Escape also ends other actions in the window.
        return pressed.key() != Qt.Key.Key_Escape

    def add_in_the_middle(self) -> None:
        """Add a mode or point in the middle of the TF's visible part."""
        lo, hi = self._moves.tf.scalar_range
        first, last = self._area.axis.visible
        if max(lo, first) < min(hi, last):
            lo, hi = max(lo, first), min(hi, last)
        self._moves.add_opacity((lo + hi) / 2, NEW_HEIGHT)

    def _nudge(self, right: int, up: int) -> None:
        """Move the selected handles by bins of the range and hundredths of opacity."""
        opacity, index = self._moves.tf.opacity, self._selection.index("opacity")
        shift, flank = right * opacity.bin_width, self._selection.flank
        if flank is None or index is None or opacity.points:
            self._moves.nudge(shift, up * _NUDGE_HEIGHT)
        elif right:
            width = opacity.modes[index].width + (shift if flank == 1 else -shift)
            resized = edits.resize_mode(opacity, index, width)
            self._moves.set_opacity(resized, "width", f"nudge width {index}")

    def _go(self, step: int) -> None:
        """Go to the next or the previous handle; beyond the first and last one, leave the plots."""
        targets, selection = self._targets(), self._selection
        if selection.current is None:
            at = -1 if step > 0 else len(targets)
        else:
            at = targets.index((selection.kind, selection.current, selection.flank))
        if 0 <= at + step < len(targets):
            kind, index, flank = targets[at + step]
            selection.select(kind, index, flank=flank)
        elif step > 0:
            self._area.widget.window().focusNextChild()
        else:
            self._area.widget.window().focusPreviousChild()

    def _add(self) -> None:
        """Add a colour stop after the current one, or else a mode or point."""
        stop = self._selection.index("color")
        if stop is None:
            self.add_in_the_middle()
            return
        values = [each[0] for each in self._moves.tf.color.stops]
        first = min(stop, len(values) - 2)
        self._moves.add_stop((values[first] + values[first + 1]) / 2)

    def _select_all(self) -> None:
        """Select all handles of the current one's kind, or all modes or points."""
        kind = self._selection.kind if self._selection.current is not None else "opacity"
        indices = [index for of, index, flank in self._targets() if of == kind and flank is None]
        self._selection.select(kind, *indices)

    def _targets(self) -> list[tuple[Kind, int, int | None]]:
        """All handles in the order of Tab: modes with their flanks or points, then stops."""
        tf = self._moves.tf
        flanks = (None,) if tf.opacity.points else (None, 0, 1)
        count = len(edits.opacity_handles(tf.opacity))
        targets: list[tuple[Kind, int, int | None]] = [
            ("opacity", index, flank) for index in range(count) for flank in flanks
        ]
        return targets + [("color", index, None) for index in range(len(tf.color.stops))]
