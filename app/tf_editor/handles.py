"""Handles of a TF: their look, selection, moving, adding and removing."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from PySide6.QtCore import QObject, QPoint, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import (
    QGraphicsItem,
    QGraphicsObject,
    QGraphicsSceneContextMenuEvent,
    QGraphicsSceneMouseEvent,
    QStyle,
    QStyleOptionGraphicsItem,
    QWidget,
)

from app import theme
from app.engines.background import Pause
from app.state.viewer_state import STEP_MS, ViewerState
from model.scene import tf_editing as edits
from model.scene.transfer_function import OpacityTF, TransferFunction

Shape = Literal["circle", "square", "pin", "line"]

_RADIUS = {"circle": 6.0, "square": 4.0, "pin": 6.0, "line": 0.0}
_REACH = 12.0  # half the edge of the square that takes the mouse, in pixels

_ADDING = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier


class DragHandle(QGraphicsObject):
    """A draggable mark of constant size in pixels, at a place in the plot."""

    def __init__(
        self,
        shape: Shape,
        drag: Callable[[float, float], object],
        release: Callable[[], object],
        press: Callable[[bool], object] = lambda _adds: None,
        menu: Callable[[QPoint], object] = lambda _point: None,
        double_click: Callable[[], object] = lambda: None,
    ) -> None:
        super().__init__()
        self.setFlag(QGraphicsItem.GraphicsItemFlag.ItemIgnoresTransformations)
        # While one is dragged, the others are painted from a cache.
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)
        self.setAcceptHoverEvents(True)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self._shape = shape
        self._drag, self._release, self._press = drag, release, press
        self.menu, self._double_click = menu, double_click
        self._look = QColor(theme.CURVE), False, False
        self._grip: QPointF | None = None
        self._wanted: QPointF | None = None
        self._pause = Pause(self, STEP_MS, self._step)

    def set_look(self, fill: QColor, selected: bool, *, ringed: bool | None = None) -> None:
        """Set fill and highlight; a ring, by default of all selected but squares, is for keys."""
        if ringed is None:
            ringed = selected and self._shape != "square"
        if self._look != (fill, selected, ringed):
            self._look = fill, selected, ringed
            self.setZValue(101 if selected else 100)
            self.update()

    def boundingRect(self) -> QRectF:
        """Return the area that is painted and reacts to the mouse, in pixels."""
        return QRectF(-_REACH, -_REACH, 2 * _REACH, 2 * _REACH)

    def paint(
        self, painter: QPainter, option: QStyleOptionGraphicsItem, _widget: QWidget | None = None
    ) -> None:
        """Draw the mark, larger under the mouse, with a ring around the selected one."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        radius = _RADIUS[self._shape] + (1.0 if is_hovered(option) else 0.0)
        fill, _selected, ringed = self._look
        if ringed:
            painter.setPen(QPen(QColor(theme.CHANGE), 2.0))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(QPointF(), radius + 3.5, radius + 3.5)
        painter.setPen(QPen(QColor(theme.PLOT), 1.0))
        painter.setBrush(QColor(theme.CURVE))
        self._draw(painter, radius)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(fill)
        self._draw(painter, radius - 1.6)

    def _draw(self, painter: QPainter, radius: float) -> None:
        if self._shape == "square":
            painter.drawRect(QRectF(-radius, -radius, 2 * radius, 2 * radius))
        elif self._shape == "pin":
            roof = (QPointF(-radius, 0), QPointF(0, -radius), QPointF(radius, 0))
            foot = (QPointF(radius, radius), QPointF(-radius, radius))
            painter.drawPolygon(QPolygonF([*roof, *foot]))
        else:
            painter.drawEllipse(QPointF(), radius, radius)

    def mousePressEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Select, and begin a drag with the left button."""
        self._press(bool(event.modifiers() & _ADDING))
        if event.button() == Qt.MouseButton.LeftButton:
            # Keep the offset between mouse and mark, so that the mark does not jump.
            self._grip = self.pos() - self._plot_position(event)
        event.accept()

    def mouseMoveEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Emit where the mark is dragged to, now or after a pause since the last time."""
        if self._grip is not None:
            self._wanted = self._plot_position(event) + self._grip
            if not self._pause.isActive():
                self._step()

    def mouseReleaseEvent(self, _event: QGraphicsSceneMouseEvent) -> None:
        """End the drag."""
        if self._grip is not None:
            self._step()
            self._grip = None
            self._release()

    def mouseDoubleClickEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Pass on the double click."""
        event.accept()
        self._double_click()

    def contextMenuEvent(self, event: QGraphicsSceneContextMenuEvent) -> None:
        """Open the mark's menu."""
        event.accept()
        self.menu(event.screenPos())

    def rest(self) -> None:
        """Drop the waiting step: the edit has ended."""
        self._wanted = None
        self._pause.stop()

    def _step(self) -> None:
        wanted, self._wanted = self._wanted, None
        if wanted is not None:
            self._pause.start()
            self._drag(wanted.x(), wanted.y())

    def _plot_position(self, event: QGraphicsSceneMouseEvent) -> QPointF:
        return self.parentItem().mapFromScene(event.scenePos())


def is_hovered(option: QStyleOptionGraphicsItem) -> bool:
    """Return whether the painted item is under the mouse."""
    return bool(option.state & QStyle.StateFlag.State_MouseOver)


Kind = Literal["opacity", "color"]
KINDS: tuple[Kind, Kind] = "opacity", "color"


class Selection(QObject):
    """Holds which handles, all of one kind, are selected, and emits `changed`.

    The last selected one is current: its numbers are shown. If keys act on its left or right flank,
    the flank is 0 or 1.
    """

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.kind: Kind = "opacity"
        self._indices: tuple[int, ...] = ()
        self.flank: int | None = None
        self._known: dict[Kind, tuple[object, ...]] = dict.fromkeys(KINDS, ())

    @property
    def current(self) -> int | None:
        """Index of the current handle; None if there is none."""
        return self._indices[-1] if self._indices else None

    def index(self, kind: Kind) -> int | None:
        """Return the index of the current handle if it is of this kind, or None."""
        return self.current if kind == self.kind else None

    def indices(self, kind: Kind) -> tuple[int, ...]:
        """Return the indices of all selected handles of this kind, in order."""
        return tuple(sorted(self._indices)) if kind == self.kind else ()

    def select(self, kind: Kind, *indices: int, flank: int | None = None) -> None:
        """Select these handles only, or a flank of one; the last one becomes the current one."""
        self._change(kind, tuple(dict.fromkeys(indices)), flank)

    def toggle(self, kind: Kind, index: int) -> None:
        """Add a handle, or take it away; those of the other kind are no longer selected."""
        present = self._indices if kind == self.kind else ()
        others = [each for each in present if each != index]
        self.select(kind, *others, *(() if index in present else (index,)))

    def clear(self) -> None:
        """Select nothing."""
        self.select(self.kind)

    def fit(self, transfer_function: TransferFunction) -> None:
        """Follow an edit: select a handle that was added, and none that no longer exists."""
        before, now = self._known, _handles(transfer_function)
        self._known, known, handles = now, before["opacity"], now["opacity"]
        added = [i for i, handle in enumerate(handles) if handle not in known]
        if len(added) == 1 and len(known) == len(handles) - 1:
            self.select("opacity", added[0])
            return
        kind, left = self.kind, self._indices
        if len(before[kind]) != len(now[kind]):
            # Their places have changed.
            stay = [before[kind][i] for i in left if before[kind][i] in now[kind]]
            left = tuple(map(now[kind].index, stay))
        keeps_flank = not transfer_function.opacity.points and left == self._indices
        self._change(kind, left, self.flank if keeps_flank else None)

    def start(self, transfer_function: TransferFunction) -> None:
        """Select nothing of another TF."""
        self._known = _handles(transfer_function)
        self.clear()

    def _change(self, kind: Kind, indices: tuple[int, ...], flank: int | None) -> None:
        if (kind, indices, flank) != (self.kind, self._indices, self.flank):
            self.kind, self._indices, self.flank = kind, indices, flank
            self.changed.emit()


def _handles(tf: TransferFunction) -> dict[Kind, tuple[object, ...]]:
    return {"opacity": tf.opacity.points or tf.opacity.modes, "color": tf.color.stops}


class HandleMoves:
    """Edits the state's TF by its handles: each drag, key and typed number is one undo step."""

    def __init__(self, state: ViewerState, selection: Selection) -> None:
        self.state, self.selection = state, selection
        self._start: TransferFunction | None = None
        self._clicked: tuple[Kind, int] | None = None
        self.colors_follow = True  # a colour stop at the mean of a mode moves along with it

    @property
    def tf(self) -> TransferFunction:
        """The TF that is edited."""
        return self.state.transfer_function

    def press(self, kind: Kind, index: int, adds: bool) -> None:
        """Select the handle pressed, with the others or alone, and remember the TF."""
        if adds:
            self.selection.toggle(kind, index)
        elif index not in self.selection.indices(kind):
            self.selection.select(kind, index)
        else:
            # One of several: they stay selected, so that they can be dragged together.
            others = (i for i in self.selection.indices(kind) if i != index)
            self.selection.select(kind, *others, index)
        self._clicked = None if adds else (kind, index)
        self._start = self.tf

    def drag(self, kind: Kind, index: int, value: float, height: float = 0.0) -> None:
        """Preview moving all selected handles along with one of them, to a value and an opacity."""
        start = self._start
        if start is None or index not in self.selection.indices(kind):
            return
        if kind == "opacity":
            at = edits.opacity_handles(start.opacity)[index]
            self.state.tf_input.move(self._moved(start, value - at[0], height - at[1]))
        else:
            self.state.tf_input.move(self._moved(start, value - start.color.stops[index][0], 0.0))

    def finish(self, text: str) -> None:
        """End a drag: one undo step. A click without a drag selects its handle alone."""
        if self._clicked is not None and not self.state.live:
            self.selection.select(*self._clicked)
        self._start = self._clicked = None
        self.state.tf_input.finish(text)

    def nudge(self, shift: float, lift: float) -> None:
        """Move the selected handles by a difference in value and in opacity."""
        kind = self.selection.kind
        if indices := self.selection.indices(kind):
            after = self._moved(self.tf, shift, lift)
            self.state.tf_input.set(after, "nudge", f"nudge {kind} {indices}")

    def set_opacity(self, opacity: OpacityTF, text: str, merges: str | None = None) -> None:
        """Replace the opacity TF; consecutive edits with one merge name are one undo step."""
        self.state.tf_input.set(replace(self.tf, opacity=opacity), text, merges)

    def add_opacity(self, value: float, height: float) -> None:
        """Add a mode or point, and select it."""
        opacity, index = edits.add_opacity_handle(self.tf.opacity, value, height)
        self.set_opacity(opacity, f"add {handle_name(opacity)}")
        self.selection.select("opacity", index)

    def add_stop(self, value: float) -> None:
        """Add a colour stop, and select it."""
        color, index = edits.add_stop(self.tf.color, value)
        self.state.tf_input.set(replace(self.tf, color=color), "add colour stop")
        self.selection.select("color", index)

    def remove_at(self, kind: Kind, index: int) -> None:
        """Remove one handle."""
        self.selection.select(kind, index)
        self.remove()

    def remove(self) -> None:
        """Remove the selected handles, all but the ends of a free curve and of the colours."""
        tf, kind = self.tf, self.selection.kind
        indices = self.selection.indices(kind)
        opacity, color = tf.opacity, tf.color
        for index in reversed(indices):
            if kind == "opacity":
                opacity = edits.remove_opacity_handle(opacity, index)
            else:
                color = edits.remove_stop(color, index)
        after = TransferFunction(opacity, color)
        if after != tf:
            self.selection.clear()
            name = handle_name(opacity) if kind == "opacity" else "colour stop"
            self.state.tf_input.set(after, f"remove {name}" + ("s" if len(indices) > 1 else ""))

    def with_opacity(self, before: TransferFunction, opacity: OpacityTF) -> TransferFunction:
        """Return a TF with moved modes and, if wanted, their colour stops."""
        if self.colors_follow:
            return edits.follow_modes(before, opacity)
        return replace(before, opacity=opacity)

    def _moved(self, tf: TransferFunction, shift: float, lift: float) -> TransferFunction:
        modes = self.selection.indices("opacity")
        if tf.opacity.points and not self.state.interpolates:
            # Handles stay on their labels.
            shift = 0.0
        if modes:
            return self.with_opacity(tf, edits.move_opacity_handles(tf.opacity, modes, shift, lift))
        stops = self.selection.indices("color")
        return replace(tf, color=edits.move_stops(tf.color, stops, shift))


def handle_name(opacity: OpacityTF) -> str:
    """Return the name of this TF's handles, "mode" or "point"."""
    return "point" if opacity.points else "mode"
