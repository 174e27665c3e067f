"""The crop box over an image: its edges, and handles that move its planes."""

from __future__ import annotations

import math
from typing import cast

from PySide6.QtCore import QEvent, QObject, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QCursor, QMouseEvent, QPainter, QPen

from app import theme
from app.image_view.crop_outline import Handle, Place, axis_line, edges_of, handles_of
from app.image_view.image_canvas import ImageCanvas
from app.state.crop_planes import WITHOUT_VOLUME, axis_name, least_length, voxel_at
from app.state.viewer_state import ViewerState
from model.scene.crop import CropBox
from model.scene.projection import Projection

RADIUS, REACH = 6.0, 10.0
"""Of a handle, and how far from its middle it takes the mouse, in pixels."""

LABEL_PLACE = QPointF(14.0, -12.0)
"""Lower left corner of a handle's label, from its middle."""

CURSORS = (
    Qt.CursorShape.SizeHorCursor,
    Qt.CursorShape.SizeBDiagCursor,
    Qt.CursorShape.SizeVerCursor,
    Qt.CursorShape.SizeFDiagCursor,
)
"""For movements to the right, and each turned by 45 degrees counter-clockwise from it."""

DRAGGED_BY = (
    QEvent.Type.MouseButtonPress,
    QEvent.Type.MouseButtonDblClick,
    QEvent.Type.MouseMove,
    QEvent.Type.MouseButtonRelease,
)


class CropHandles(QObject):
    """Shows the crop box over a canvas while it is active, and moves its planes by the mouse.

    It takes the mouse before those that were made for the canvas earlier, at its handles only.
    """

    def __init__(self, canvas: ImageCanvas, state: ViewerState) -> None:
        super().__init__(canvas)
        self._canvas = canvas
        self._state = state
        self._active = False
        self._dimensions = WITHOUT_VOLUME
        self._hovered: tuple[int, int] | None = None
        self._dragged: tuple[int, int] | None = None
        self._offset = QPointF()
        canvas.setMouseTracking(True)
        canvas.add_decoration(self._paint)
        canvas.installEventFilter(self)
        for changed in (state.viewChanged, state.crop_input.changed, state.navigationChanged):
            changed.connect(lambda *_: self._active and canvas.update())

    @property
    def handles(self) -> list[Handle]:
        """The handles that can be dragged in this view, the nearest one first."""
        return handles_of(self._box, self._projection)

    @property
    def label(self) -> str:
        """Text next to the handle under the mouse; empty if there is none."""
        plane = self._dragged or self._hovered
        if not self._active or plane is None:
            return ""
        axis, side = plane
        place = (self._box.low, self._box.high)[side][axis]
        end = "last" if side else "first"
        voxel = voxel_at(place, self._dimensions[axis])
        return f"{axis_name(axis, self._state.axis_labels)}: {end} voxel {voxel}"

    def position(self, handle: Handle) -> QPointF:
        """Return where a handle is on the canvas."""
        return self._on_canvas(handle.place)

    def set_volume(self, dimensions: tuple[int, int, int]) -> None:
        """Set the number of voxels along x, y and z."""
        self._dimensions = dimensions

    def set_active(self, active: bool) -> None:
        """Show the box and its handles, or leave the image alone."""
        if active != self._active:
            self._end_drag()
            self._hover(None)
            self._active = active
            self._canvas.update()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle mouse events on handles; pass on all others."""
        kind = event.type()
        if kind == QEvent.Type.Leave:
            self._hover(None)
        if kind == QEvent.Type.Hide:
            self._end_drag()
        if kind not in DRAGGED_BY or not self._active:
            return False
        mouse = cast(QMouseEvent, event)
        if self._dragged is not None:
            return self._continue(mouse)
        if self._canvas.image is None or self._canvas.message:
            # Nothing is painted that could be dragged.
            return False
        if kind == QEvent.Type.MouseMove:
            return self._look(mouse)
        # The second press of two quick drags is a double click.
        is_press = kind in (QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonDblClick)
        return is_press and self._press(mouse)

    @property
    def _box(self) -> CropBox:
        return self._state.crop or CropBox()

    @property
    def _projection(self) -> Projection:
        return Projection(self._state.view, self._state.proportions)

    def _press(self, event: QMouseEvent) -> bool:
        handle = self._handle_at(event.position())
        plain = event.button() == Qt.MouseButton.LeftButton and not event.modifiers()
        if handle is None or not plain:
            return False
        self._hover(handle)
        self._dragged = handle.axis, handle.side
        self._offset = self.position(handle) - event.position()
        self._canvas.update()
        return True

    def _continue(self, event: QMouseEvent) -> bool:
        if not event.buttons() & Qt.MouseButton.LeftButton:
            # The release itself, or it was kept from the canvas.
            self._end_drag()
            self._look(event)
        elif event.type() == QEvent.Type.MouseMove:
            self._drag(event.position() + self._offset)
        # Another button during a drag changes nothing.
        return True

    def _drag(self, position: QPointF) -> None:
        assert self._dragged is not None
        axis, side = self._dragged
        x, y = self._canvas.place_of(position)
        share = self._projection.nearest_on((2 * x - 1, 1 - 2 * y), *axis_line(self._box, axis))
        if share is not None:
            least = least_length(self._dimensions[axis])
            self._state.crop_input.move(self._box.with_plane(axis, side, share, least))

    def _end_drag(self) -> None:
        if self._dragged is not None:
            self._dragged = None
            self._canvas.update()
            self._state.crop_input.finish()

    def _look(self, event: QMouseEvent) -> bool:
        """Mark the handle under the mouse, and keep the event from others if there is one."""
        handle = None if event.buttons() else self._handle_at(event.position())
        self._hover(handle)
        return handle is not None

    def _hover(self, handle: Handle | None) -> None:
        plane = None if handle is None else (handle.axis, handle.side)
        if plane == self._hovered:
            return
        self._hovered = plane
        shape = Qt.CursorShape.OpenHandCursor if handle is None else self._cursor(handle)
        self._canvas.setCursor(QCursor(shape))
        self._canvas.update()

    def _cursor(self, handle: Handle) -> Qt.CursorShape:
        """The cursor along the image of the handle's axis."""
        part = self._projection.seen_part(*axis_line(self._box, handle.axis))
        assert part is not None
        (x0, y0), (x1, y1) = self._projection.places(part)
        return CURSORS[round(math.atan2(y1 - y0, x1 - x0) / (math.pi / 4)) % 4]

    def _handle_at(self, position: QPointF) -> Handle | None:
        """The handle under the mouse, the nearer one of two."""
        for handle in self.handles:
            away = self.position(handle) - position
            if math.hypot(away.x(), away.y()) <= REACH:
                return handle
        return None

    def _on_canvas(self, place: Place) -> QPointF:
        rect, (x, y) = self._canvas.image_rect, place
        return QPointF(
            rect.left() + rect.width() * (1 + x) / 2, rect.top() + rect.height() * (1 - y) / 2
        )

    def _paint(self, painter: QPainter, _rect: QRect) -> None:
        if not self._active:
            return
        # Beside a picture that is smaller than its pane there is no volume.
        painter.setClipRect(self._canvas.picture_rect)
        self._paint_edges(painter)
        handles = self.handles
        for handle in reversed(handles):
            self._paint_handle(painter, handle)
        plane = self._dragged or self._hovered
        for handle in handles:
            if (handle.axis, handle.side) == plane:
                self._paint_label(painter, self.position(handle))

    def _paint_edges(self, painter: QPainter) -> None:
        for edge in edges_of(self._box, self._projection):
            pens = [QPen(QColor(theme.ON_IMAGE.disabled), 1.0, Qt.PenStyle.DashLine)]
            if not edge.is_behind:
                # A dark line beneath, so that it is seen on bright pictures, too.
                pens = [
                    QPen(QColor(theme.ON_IMAGE.window), 3.0),
                    QPen(QColor(theme.ON_IMAGE.text), 1.2),
                ]
            for pen in pens:
                painter.setPen(pen)
                painter.drawLine(self._on_canvas(edge.start), self._on_canvas(edge.end))

    def _paint_handle(self, painter: QPainter, handle: Handle) -> None:
        fill = QColor(theme.ON_IMAGE.disabled if handle.is_behind else theme.ON_IMAGE.text)
        if (handle.axis, handle.side) in (self._dragged, self._hovered):
            fill = QColor(theme.ON_IMAGE.change)
        painter.setPen(QPen(QColor(theme.ON_IMAGE.window), 1.5))
        painter.setBrush(fill)
        painter.drawEllipse(self.position(handle), RADIUS, RADIUS)

    def _paint_label(self, painter: QPainter, at: QPointF) -> None:
        size = painter.fontMetrics().size(0, self.label)
        box = QRectF(0, 0, size.width() + 12, size.height() + 6)
        box.moveBottomLeft(at + LABEL_PLACE)
        limits = self._canvas.rect()
        # Whole, also for handles at the image's edge.
        box.moveLeft(max(min(box.left(), limits.right() - box.width()), 0.0))
        box.moveTop(max(box.top(), 0.0))
        painter.setPen(QColor(theme.ON_IMAGE.line))
        painter.setBrush(QColor(theme.ON_IMAGE.panel))
        painter.drawRoundedRect(box, 4, 4)
        painter.setPen(QColor(theme.ON_IMAGE.text))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, self.label)
