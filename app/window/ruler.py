"""A ruler: two clicks or a drag in an image or a slice, and the distance between the places."""

from dataclasses import replace
from typing import cast

from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QCursor, QMouseEvent, QPainter
from PySide6.QtWidgets import QApplication, QWidget

from app.image_view.image_canvas import ImageCanvas
from app.slices.slice_view import SliceView
from app.window.context import Context
from app.window.figure import Marks
from app.window.overlays import Overlays
from app.window.slices import Slices
from model.rendering.ray_places import ray_places
from model.scene.slices import voxel_of
from model.scene.view import from_middle
from model.scene.volume import Triple


class Ruler(QObject):
    """Takes two clicks or a drag; images and slices show the line between its ends.

    The line stays until Escape or until the next line is complete.
    """

    def __init__(self, context: Context, overlays: Overlays, slices: Slices) -> None:
        super().__init__(context.window)
        self._context, self._overlays, self._slices = context, overlays, slices
        self.is_on = self._took = False
        self._first: tuple[Triple, ...] = ()
        self._before: tuple[Triple, ...] = ()  # the previous line
        self._pressed = QPointF()  # where the mouse went down
        for pane in context.panes:
            pane.canvas.installEventFilter(self)
        slices.filters.append(self)
        slices.state.marks.append(self._paint)

    def toggle(self) -> None:
        """Start or stop measuring."""
        if self.end() or self._context.workspace.opened is None:
            return
        self.is_on, self._first, self._before = True, (), self._overlays.subject.line
        self._context.sensitivity.set_tool(None)
        self._context.status.say("To measure, click two places or drag from one to the other …")

    def end(self) -> bool:
        """End measuring; return False if there is nothing to end."""
        was_on, self.is_on = self.is_on, False
        if was_on:
            self._context.status.say("")
            self._show(self._before)
        return was_on

    def remove(self) -> bool:
        """Remove the line; return False if there is none."""
        had_line = bool(self._overlays.subject.line)
        self._show(())
        return had_line

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the left clicks and drags, and the other movements, while the ruler is on."""
        kind, press, move = event.type(), QEvent.Type.MouseButtonPress, QEvent.Type.MouseMove
        release = QEvent.Type.MouseButtonRelease
        if kind == QEvent.Type.MouseButtonDblClick:
            # The second click of a double click: neither another point nor a reset of the view.
            return self._took
        self._took = self._took and kind != press
        if not self.is_on or kind not in (press, move, release):
            return False
        widget, mouse = cast(QWidget, watched), cast(QMouseEvent, event)
        if self._context.sensitivity.tool is not None:
            # A region is being drawn.
            self.end()
            return False
        if kind == move:
            widget.setCursor(QCursor(Qt.CursorShape.CrossCursor))
            # Slices go on naming the value under the mouse.
            return isinstance(widget, ImageCanvas) and (self._took or not mouse.buttons())
        if mouse.button() != Qt.MouseButton.LeftButton or mouse.modifiers():
            return False
        way = (mouse.position() - self._pressed).manhattanLength()
        if kind == release and (not self._took or way < QApplication.startDragDistance()):
            return self._took
        self._pressed = mouse.position()
        self._click(widget, mouse.position())
        self._took = True
        return True

    def _click(self, widget: QWidget, position: QPointF) -> None:
        opened, say = self._context.workspace.opened, self._context.status.say
        subject, found = self._overlays.subject, list[Triple | None]()
        if opened is None or subject.scale is None:
            return
        if isinstance(widget, ImageCanvas):
            if widget.image is None or widget.message:
                return
            at, inputs = from_middle(widget.place_of(position)), self._context.state.inputs
            # The press has given the focus to A or B.
            found += [place for place, _share in ray_places(opened.volume, inputs, at)]
        else:
            found.append(cast(SliceView, widget.parent()).place_under(position))
        if not found or found[0] is None:
            say("Nothing shows there; click on something that does.")
            return
        if not subject.line:
            # They may have been the previous volume's.
            self._first = self._before = ()
        line = (*self._first, found[0])
        self.is_on, self._first = len(line) < 2, line[:1]
        self._show(line)
        if self.is_on:
            say("Click the second place …")
        else:
            say(f"Distance: {subject.scale.length_text(*line)}")

    def _show(self, line: tuple[Triple, ...]) -> None:
        self._overlays.subject = replace(self._overlays.subject, line=line)
        for pane in self._context.panes if not self.is_on else ():
            pane.canvas.setCursor(QCursor(Qt.CursorShape.OpenHandCursor))
        self._slices.state.changed.emit()
        self._context.update_images()

    def _paint(self, view: SliceView, painter: QPainter) -> None:
        """Paint the line in a slice that has its ends."""
        subject, state, axis = self._overlays.subject, self._slices.state, view.plane.axis
        marks = Marks.over(painter, view.rect(), view.fontInfo().pixelSize())
        if state.volume is not None and subject.line and marks is not None:
            places = (
                voxel_of(state.volume, state.place),
                *(voxel_of(state.volume, end) for end in subject.line),
            )
            if len({place[axis] for place in places}) == 1:
                marks.ruler(subject, [view.position_of(end) for end in subject.line])
