"""Crop box and clipping plane over an image: their edges, and handles that move them."""

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
from model.scene.view import NEAREST_DEPTH, Projection, from_middle

RADIUS, REACH = 6.0, 10.0  # of a handle, and its distance that takes the mouse, pixels
LABEL_PLACE = QPointF(14.0, -12.0)  # lower left corner of a handle's label, from its middle

CURSORS = (
    Qt.CursorShape.SizeHorCursor,
    Qt.CursorShape.SizeBDiagCursor,
    Qt.CursorShape.SizeVerCursor,
    Qt.CursorShape.SizeFDiagCursor,
)
"""Cursors by direction of movement: to the right, then in steps of 45 degrees counter-clockwise."""

MOST_COSINE = 0.985  # largest cosine of axis and line of sight at which its planes are dragged
ARROW = 0.3  # length of the clipping plane's normal, in halves of the image's shorter side
MOVES, TURNS = (3, 0), (3, 1)  # the handles that move and turn the clipping plane
PLANE_LABELS = {MOVES: "Drag: move the plane", TURNS: "Drag: turn the plane"}
Points = NDArray[np.float64]
Kind = tuple[int, int]  # axis of a face, and 0 for the lower or 1 for the upper

PRESSES = QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonDblClick
DRAGGED_BY = (*PRESSES, QEvent.Type.MouseMove, QEvent.Type.MouseButtonRelease)


@dataclass(frozen=True)
class Handle:
    """A handle in the middle of a face of the box, or one of the clipping plane."""

    kind: Kind
    point: Points  # (3,)
    is_behind: bool


class CropHandles(QObject):
    """Shows crop box and clipping plane over a canvas while active; the mouse moves them."""

    def __init__(self, canvas: ImageCanvas, state: ViewerState) -> None:
        super().__init__(canvas)
        self._canvas = canvas
        self._state = state
        self._active = False
        self._dimensions = WITHOUT_VOLUME
        self._hovered: Kind | None = None
        self._dragged: Kind | None = None
        self._offset = QPointF()
        self._pivot: Points | None = None
        """Point about which the clipping plane was last turned; its handle is next to it."""
        self._is_front = True
        canvas.setMouseTracking(True)
        canvas.decorations.append(self._paint)
        canvas.installEventFilter(self)
        cuts = state.crop_input.changed, state.clip_input.changed
        for changed in (state.viewChanged, *cuts, state.navigationChanged):
            changed.connect(self._follow)

    @property
    def handles(self) -> list[Handle]:
        """The handles that can be dragged in this view, the nearest one first."""
        box, clip, projection = self._box, self._state.clip, self._projection
        found, visible = list[Handle](), _visible_faces(box, projection)
        for axis, side in itertools.product(range(3), (0, 1)):
            point = _middle(box)
            point[axis] = (box.low, box.high)[side][axis]
            found.append(Handle((axis, side), point, not visible[axis][side]))
        if clip is not None:
            ends = zip((MOVES, TURNS), self._arrow(clip), strict=True)
            found += [Handle(kind, point, False) for kind, point in ends]
        depths = projection.depths(np.array([handle.point for handle in found]))
        order = [n for n in np.argsort(depths) if depths[n] > NEAREST_DEPTH]
        return [found[n] for n in order if self._has_way(found[n])]

    def _has_way(self, handle: Handle) -> bool:
        """Whether a handle can be moved in the image: its axis is not along the line of sight."""
        clip, way = self._state.clip, np.eye(4, 3)[handle.kind[0]]
        if handle.kind == MOVES and clip is not None:
            way = np.array(clip.normal)
        return abs(float(self._projection.sight(handle.point) @ way)) <= MOST_COSINE

    def _label(self, kind: Kind) -> str:
        if kind in PLANE_LABELS:
            return PLANE_LABELS[kind]
        axis, side = kind
        voxel = 1 + voxel_at((self._box.low, self._box.high)[side][axis], self._dimensions[axis])
        name = axis_name(axis, self._state.axis_labels)
        return f"{name}: {'last' if side else 'first'} voxel {voxel}"

    def position(self, handle: Handle) -> QPointF:
        """Return where a handle is on the canvas."""
        return self._on_canvas(handle.point[None])[0]

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
        return kind in PRESSES and self._press(mouse)

    def _follow(self, _change: object = None) -> None:
        """Show the box; unmark a handle that is no longer under the mouse, as after an undo."""
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
        self._dragged = handle.kind
        self._offset = self.position(handle) - event.position()
        if self._state.clip is not None:
            self._pivot = self._base(self._state.clip)
            self._is_front = float(self._state.view.basis()[2] @ self._state.clip.normal) >= 0
        self._canvas.update()
        return True

    def _continue(self, event: QMouseEvent) -> bool:
        if not event.buttons() & Qt.MouseButton.LeftButton:
            # The release itself, or another widget has taken it.
            self._end_drag()
            self._look(event)
        elif event.type() == QEvent.Type.MouseMove:
            self._drag(event.position() + self._offset)
        # Another button during a drag changes nothing.
        return True

    def _drag(self, position: QPointF) -> None:
        kind, state, projection = self._dragged, self._state, self._projection
        place = from_middle(self._canvas.place_of(position))
        # An undo may have taken the plane away.
        if kind is None or (kind in PLANE_LABELS and state.clip is None):
            return
        if kind == TURNS and self._pivot is not None:
            # As on a ball around the handle, on the side of the previous normal.
            x, y = (np.array(place) - projection.places(self._pivot[None])[0]) / ARROW
            z = math.sqrt(max(1 - x**2 - y**2, 0.0))
            normal = np.array([x, y, z if self._is_front else -z]) @ state.view.basis()
            state.clip_input.move(ClipPlane.through(self._pivot, normal, state.proportions))
            return
        share = projection.nearest_on(place, *self._line(kind))
        if share is None:
            return
        if state.clip is not None and kind == MOVES:
            state.clip_input.move(replace(state.clip, offset=2 * share - 1))
        else:
            axis, side = kind
            least = least_length(self._dimensions[axis])
            state.crop_input.move(self._box.with_plane(axis, side, share, least))

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
        kind = None if handle is None else handle.kind
        if kind == self._hovered:
            return
        self._hovered = kind
        shape = Qt.CursorShape.OpenHandCursor if handle is None else self._cursor(handle)
        self._canvas.setCursor(QCursor(shape))
        self._canvas.update()

    def _cursor(self, handle: Handle) -> Qt.CursorShape:
        """The cursor along the image of the handle's axis."""
        if handle.kind == TURNS:
            return Qt.CursorShape.SizeAllCursor
        part = self._projection.seen_part(*self._line(handle.kind))
        assert part is not None
        (x0, y0), (x1, y1) = self._projection.places(part)
        return CURSORS[round(math.atan2(y1 - y0, x1 - x0) / (math.pi / 4)) % 4]

    def _base(self, clip: ClipPlane) -> Points:
        """Point of the clipping plane's handle: next to what it was turned about."""
        pivot = self._state.pivot if self._pivot is None else self._pivot
        return clip.nearest(pivot, self._state.proportions)

    def _arrow(self, clip: ClipPlane) -> Points:
        """The clipping plane's normal as a line (2, 3) of the same length in every view."""
        base = self._base(clip)
        length = ARROW * float(self._projection.half_sides(base[None])[0]) / 2
        return np.array([base, base + length * np.array(clip.normal) / self._state.proportions])

    def _line(self, kind: Kind) -> Points:
        """The line that a handle moves along, through all of the volume, (2, 3)."""
        clip = self._state.clip
        if clip is not None and kind == MOVES:
            return np.array([self._base(replace(clip, offset=end)) for end in (-1.0, 1.0)])
        line = np.tile(_middle(self._box), (2, 1))
        line[:, kind[0]] = 0.0, 1.0
        return line

    def _handle_at(self, position: QPointF) -> Handle | None:
        """The handle under the mouse, the nearer one of two."""
        places = ((handle, self.position(handle) - position) for handle in self.handles)
        return next((each for each, by in places if math.hypot(by.x(), by.y()) <= REACH), None)

    def _on_canvas(self, points: Points) -> list[QPointF]:
        rect = self._canvas.image_rect
        corner, size = (rect.left(), rect.top()), (rect.width(), rect.height())
        places = corner + np.multiply(size, 1 + self._projection.places(points) * (1, -1)) / 2
        return [QPointF(*place) for place in places.tolist()]

    def _paint(self, painter: QPainter, _rect: QRect) -> None:
        if not self._active:
            return
        # Around a picture that is smaller than its pane there is no volume.
        painter.setClipRect(self._canvas.picture_rect)
        box, clip, projection = self._box, self._state.clip, self._projection
        for line, is_behind in _edges_of(box, projection):
            self._paint_line(painter, line, theme.ON_IMAGE.text, is_behind)
        if clip is not None:
            corners = clip.outline(box, projection.proportions)
            for line in (*np.stack([corners, np.roll(corners, -1, axis=0)], 1), self._arrow(clip)):
                self._paint_line(painter, line, theme.ON_IMAGE.change)
        handles, kind = self.handles, self._dragged or self._hovered
        for handle in reversed(handles):
            self._paint_handle(painter, handle, is_marked=handle.kind == kind)
        for handle in handles:
            if handle.kind == kind:
                self._paint_label(painter, self.position(handle), self._label(kind))

    def _paint_line(
        self, painter: QPainter, line: Points, color: str, is_behind: bool = False
    ) -> None:
        part = self._projection.seen_part(*line)
        if part is None:
            return
        pens = [QPen(QColor(theme.ON_IMAGE.disabled), 1.0, Qt.PenStyle.DashLine)]
        if not is_behind:
            # A dark line beneath, so that it is seen on bright pictures, too.
            pens = [QPen(QColor(theme.ON_IMAGE.window), 3.0), QPen(QColor(color), 1.2)]
        for pen in pens:
            painter.setPen(pen)
            painter.drawLine(*self._on_canvas(part))

    def _paint_handle(self, painter: QPainter, handle: Handle, is_marked: bool) -> None:
        marked, usual = theme.ON_IMAGE.change, theme.ON_IMAGE.text
        if handle.kind in PLANE_LABELS:
            marked, usual = usual, marked
        plain = theme.ON_IMAGE.disabled if handle.is_behind else usual
        painter.setPen(QPen(QColor(theme.ON_IMAGE.window), 1.5))
        painter.setBrush(QColor(marked if is_marked else plain))
        painter.drawEllipse(self.position(handle), RADIUS, RADIUS)

    def _paint_label(self, painter: QPainter, at: QPointF, text: str) -> None:
        size = painter.fontMetrics().size(0, text)
        box = QRectF(0, 0, size.width() + 12, size.height() + 6)
        box.moveBottomLeft(at + LABEL_PLACE)
        # Whole, also for handles at the image's edge.
        left = min(box.left(), self._canvas.width() - 1 - box.width())
        box.moveTo(max(left, 0.0), max(box.top(), 0.0))
        painter.setPen(QColor(theme.ON_IMAGE.line))
        painter.setBrush(QColor(theme.ON_IMAGE.panel))
        painter.drawRoundedRect(box, 4, 4)
        painter.setPen(QColor(theme.ON_IMAGE.text))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)


def _edges_of(box: CropBox, projection: Projection) -> list[tuple[Points, bool]]:
    """The box's edges (2, 3), and whether they are behind it; those first."""
    visible, ends = _visible_faces(box, projection), np.array([box.low, box.high])
    found = []
    for axis, sides in itertools.product(range(3), itertools.product((0, 1), repeat=2)):
        at = np.insert(sides, axis, 0)
        line = np.stack([ends[at, range(3)]] * 2)
        line[1, axis] = box.high[axis]
        in_front = any(visible[other][at[other]] for other in range(3) if other != axis)
        found.append((line, not in_front))
    return sorted(found, key=lambda edge: not edge[1])


def _middle(box: CropBox) -> Points:
    return (np.array(box.low) + np.array(box.high)) / 2


def _visible_faces(box: CropBox, projection: Projection) -> list[tuple[bool, bool]]:
    """Whether the lower and the upper face along each axis is turned to the eye."""
    ways = (projection.sight(np.array(corner)) for corner in (box.low, box.high))
    return [(bool(low > 0), bool(high < 0)) for low, high in zip(*ways, strict=True)]
