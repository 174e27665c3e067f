"""Crop box and clipping plane over an image: their edges, and handles that move them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QCursor, QMouseEvent, QPainter, QPen

from app import theme
from app.image_view.image_canvas import ImageCanvas
from app.state.viewer_state import ViewerState
from model.scene.clip_plane import ClipPlane
from model.scene.crop import WITHOUT_VOLUME, CropBox, axis_name, least_length, voxel_at
from model.scene.view import NEAREST_DEPTH, Projection

RADIUS, REACH = 6.0, 10.0  # of a handle, and how far from its middle it takes the mouse, in pixels
LABEL_PLACE = QPointF(14.0, -12.0)  # lower left corner of a handle's label, from its middle

CURSORS = (
    Qt.CursorShape.SizeHorCursor,
    Qt.CursorShape.SizeBDiagCursor,
    Qt.CursorShape.SizeVerCursor,
    Qt.CursorShape.SizeFDiagCursor,
)
"""For movements to the right, and each turned by 45 degrees counter-clockwise from it."""

LEAST_SINE = 0.17  # of the angle between an axis and the line of sight, to drag its planes
ARROW = 0.3  # length of the clipping plane's normal, in halves of the image's shorter side
MOVES, TURNS = (3, 0), (3, 1)  # axis and side of the handles that move and turn the clipping plane
PLANE_LABELS = {MOVES: "Drag: move the plane", TURNS: "Drag: turn the plane"}
Place = tuple[float, float]  # right and up from the middle, in halves of the shorter side

DRAGGED_BY = (
    QEvent.Type.MouseButtonPress,
    QEvent.Type.MouseButtonDblClick,
    QEvent.Type.MouseMove,
    QEvent.Type.MouseButtonRelease,
)


@dataclass(frozen=True)
class Handle:
    """A handle at the middle of a face: of the lower plane of an axis, side 0, or of the upper.

    The clipping plane's are :data:`MOVES` and :data:`TURNS`.
    """

    axis: int
    side: int
    place: Place
    depth: float
    is_behind: bool


@dataclass(frozen=True)
class _Edge:
    """An edge of the box, as far as it is in front of the eye; or one of the clipping plane."""

    start: Place
    end: Place
    is_behind: bool
    color: str = theme.ON_IMAGE.text


class CropHandles(QObject):
    """Shows crop box and clipping plane over a canvas while active, and moves them by the mouse."""

    def __init__(self, canvas: ImageCanvas, state: ViewerState) -> None:
        super().__init__(canvas)
        self._canvas = canvas
        self._state = state
        self._active = False
        self._dimensions = WITHOUT_VOLUME
        self._hovered: tuple[int, int] | None = None
        self._dragged: tuple[int, int] | None = None
        self._offset = QPointF()
        self._pivot: NDArray[np.float64] | None = None
        """Point about which the clipping plane was turned last: its handle is next to it."""
        self._is_front = True
        canvas.setMouseTracking(True)
        canvas.add_decoration(self._paint)
        canvas.installEventFilter(self)
        cuts = state.crop_input.changed, state.clip_input.changed
        for changed in (state.viewChanged, *cuts, state.navigationChanged):
            changed.connect(self._follow)

    @property
    def handles(self) -> list[Handle]:
        """The handles that can be dragged in this view, the nearest one first."""
        projection = self._projection
        found = _handles_of(self._box, projection)
        if self._state.clip is not None:
            base = self._base(self._state.clip)
            found += _plane_handles(self._state.clip, base, projection)
        return sorted(found, key=lambda handle: handle.depth)

    @property
    def label(self) -> str:
        """Text next to the handle under the mouse; empty if there is none."""
        plane = self._dragged or self._hovered
        if not self._active or plane is None:
            return ""
        if plane in PLANE_LABELS:
            return PLANE_LABELS[plane]
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
        self._dimensions, self._pivot = dimensions, None

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

    def _follow(self, _change: object = None) -> None:
        """Show the box; a handle that has left the mouse, as after an undo, is marked no more."""
        if self._active:
            if self._dragged is None:
                self._hover(None)
            self._canvas.update()

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
        if self._state.clip is not None:
            self._pivot = self._base(self._state.clip)
            self._is_front = float(self._state.view.basis()[2] @ self._state.clip.normal) >= 0
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
        place = 2 * x - 1, 1 - 2 * y
        if axis == MOVES[0]:
            self._drag_plane(place)
            return
        share = self._projection.nearest_on(place, *_axis_line(self._box, axis))
        if share is not None:
            least = least_length(self._dimensions[axis])
            self._state.crop_input.move(self._box.with_plane(axis, side, share, least))

    def _drag_plane(self, place: Place) -> None:
        """Move the clipping plane along its normal, or turn it about its handle."""
        clip, projection = self._state.clip, self._projection
        if clip is None or self._pivot is None:
            return
        if self._dragged == MOVES:
            share = projection.nearest_on(place, *self._plane_line(clip))
            if share is not None:
                self._state.clip_input.move(replace(clip, offset=2 * share - 1))
            return
        # As on a ball around the handle, on the side that the normal was on.
        x, y = (np.array(place) - projection.places(self._pivot[None])[0]) / ARROW
        length = math.hypot(x, y)
        z = math.sqrt(max(1 - length**2, 0.0))
        normal = np.array([x, y, z if self._is_front else -z]) @ self._state.view.basis()
        plane = ClipPlane.through(self._pivot, normal, self._state.proportions)
        self._state.clip_input.move(plane)

    def _end_drag(self) -> None:
        if self._dragged is not None:
            self._dragged = None
            self._canvas.update()
            self._state.crop_input.finish()
            self._state.clip_input.finish()

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
        clip = self._state.clip
        if clip is None or handle.axis != MOVES[0]:
            line = _axis_line(self._box, handle.axis)
        elif handle.side == TURNS[1]:
            return Qt.CursorShape.SizeAllCursor
        else:
            line = self._plane_line(clip)
        part = self._projection.seen_part(*line)
        assert part is not None
        (x0, y0), (x1, y1) = self._projection.places(part)
        return CURSORS[round(math.atan2(y1 - y0, x1 - x0) / (math.pi / 4)) % 4]

    def _base(self, clip: ClipPlane) -> NDArray[np.float64]:
        """Where the clipping plane's handle is: next to what it was turned about."""
        pivot = self._state.pivot if self._pivot is None else self._pivot
        return clip.nearest(pivot, self._state.proportions)

    def _plane_line(self, clip: ClipPlane) -> NDArray[np.float64]:
        """The line that the clipping plane's handle moves along, (2, 3)."""
        ends = (replace(clip, offset=offset) for offset in (-1.0, 1.0))
        return np.array([self._base(end) for end in ends])

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
        # Around a picture that is smaller than its pane there is no volume.
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
        edges = _edges_of(self._box, self._projection)
        if self._state.clip is not None:
            base = self._base(self._state.clip)
            edges += _plane_edges(self._state.clip, base, self._box, self._projection)
        for edge in edges:
            pens = [QPen(QColor(theme.ON_IMAGE.disabled), 1.0, Qt.PenStyle.DashLine)]
            if not edge.is_behind:
                # A dark line beneath, so that it is seen on bright pictures, too.
                pens = [QPen(QColor(theme.ON_IMAGE.window), 3.0), QPen(QColor(edge.color), 1.2)]
            for pen in pens:
                painter.setPen(pen)
                painter.drawLine(self._on_canvas(edge.start), self._on_canvas(edge.end))

    def _paint_handle(self, painter: QPainter, handle: Handle) -> None:
        marked, usual = theme.ON_IMAGE.change, theme.ON_IMAGE.text
        if handle.axis == MOVES[0]:
            marked, usual = usual, marked
        is_marked = (handle.axis, handle.side) in (self._dragged, self._hovered)
        plain = theme.ON_IMAGE.disabled if handle.is_behind else usual
        fill = QColor(marked if is_marked else plain)
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


def _handles_of(box: CropBox, projection: Projection) -> list[Handle]:
    visible = _visible_faces(box, projection)
    found = []
    for axis in range(3):
        line = _axis_line(box, axis)
        for side, share in enumerate((box.low[axis], box.high[axis])):
            middle = line[0] + share * (line[1] - line[0])
            depth = float(projection.depths(middle[None])[0])
            if depth > NEAREST_DEPTH and _sine(projection, middle, axis) >= LEAST_SINE:
                place = _place(projection.places(middle[None])[0])
                found.append(Handle(axis, side, place, depth, not visible[axis][side]))
    return found


def _normal_line(
    clip: ClipPlane, base: NDArray[np.float64], projection: Projection
) -> NDArray[np.float64]:
    """The clipping plane's normal as an arrow, (2, 3): as long in each view."""
    length = ARROW * float(projection.half_sides(base[None])[0]) / 2
    return np.stack([base, base + length * np.array(clip.normal) / projection.proportions])


def _plane_handles(
    clip: ClipPlane, base: NDArray[np.float64], projection: Projection
) -> list[Handle]:
    line = _normal_line(clip, base, projection)
    ends = zip((MOVES, TURNS), projection.places(line), projection.depths(line), strict=True)
    # Along the line of sight there is no way to move.
    is_along = abs(float(projection.sight(base) @ clip.normal)) > math.sqrt(1 - LEAST_SINE**2)
    return [
        Handle(*kind, _place(place), float(depth), False)
        for kind, place, depth in ends
        if depth > NEAREST_DEPTH and not (is_along and kind == MOVES)
    ]


def _plane_edges(
    clip: ClipPlane, base: NDArray[np.float64], box: CropBox, projection: Projection
) -> list[_Edge]:
    """The edges of the clipping plane in the box, and its normal."""
    corners = clip.outline(box, projection.proportions)
    lines = [*zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    lines.append(tuple(_normal_line(clip, base, projection)))
    parts = [part for line in lines if (part := projection.seen_part(*line)) is not None]
    ends = (map(_place, projection.places(part)) for part in parts)
    return [_Edge(start, end, False, theme.ON_IMAGE.change) for start, end in ends]


def _edges_of(box: CropBox, projection: Projection) -> list[_Edge]:
    """Edges that are in front of the eye, those behind the box first."""
    visible = _visible_faces(box, projection)
    found = []
    for axis in range(3):
        second, third = (other for other in range(3) if other != axis)
        for sides in itertools.product((0, 1), repeat=2):
            start, end = np.array(box.low), np.array(box.high)
            start[second] = end[second] = (box.low, box.high)[sides[0]][second]
            start[third] = end[third] = (box.low, box.high)[sides[1]][third]
            part = projection.seen_part(start, end)
            if part is not None:
                first, last = projection.places(part)
                in_front = visible[second][sides[0]] or visible[third][sides[1]]
                found.append(_Edge(_place(first), _place(last), not in_front))
    return sorted(found, key=lambda edge: not edge.is_behind)


def _axis_line(box: CropBox, axis: int) -> NDArray[np.float64]:
    """The line that a plane's handle moves along, through all of the volume, (2, 3)."""
    line = np.tile((np.array(box.low) + np.array(box.high)) / 2, (2, 1))
    line[:, axis] = 0.0, 1.0
    return line


def _visible_faces(box: CropBox, projection: Projection) -> list[tuple[bool, bool]]:
    """Whether the lower and the upper face along each axis is turned to the eye."""
    ways = (projection.sight(np.array(corner)) for corner in (box.low, box.high))
    return [(bool(low > 0), bool(high < 0)) for low, high in zip(*ways, strict=True)]


def _sine(projection: Projection, point: NDArray[np.float64], axis: int) -> float:
    """Sine of the angle between an axis and the line of sight through a point."""
    return math.sqrt(max(0.0, 1.0 - float(projection.sight(point)[axis]) ** 2))


def _place(place: NDArray[np.float64]) -> Place:
    return float(place[0]), float(place[1])
