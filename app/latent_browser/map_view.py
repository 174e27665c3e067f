"""The map: points, thumbnails and marks, with brush, lasso, hovering, panning and zooming.

The module is long because the mouse and the keys have the same of all of them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from app import theme
from app.controls import BY_KEYS
from app.image_view.image_canvas import paint_ring, to_qimage
from app.latent_browser import map_marks as marks
from app.latent_browser.map_colors import Shades
from app.latent_browser.map_frame import MapFrame
from app.latent_browser.point_cloud import (
    RADIUS,
    THUMBNAIL,
    THUMBNAILS_FROM,
    apart,
    density_contours,
    draw_points,
)
from app.state.brightness import Brightness
from app.state.latent_pictures import LatentPictures
from app.state.latent_session import LatentSession
from app.state.latent_state import LatentState, Place
from app.state.latent_thumbnails import LatentThumbnails
from model.latent.interpolation import Brush

Grip = Literal["new", "move", "pan", "lasso", "left", "right", "lower", "upper"]

REACH = 7
"""Distance in pixels at which the brush's edges are gripped."""

CLICK_REACH = 4
"""A press that moves less is a click."""

WHEEL_FACTOR = 1.2
KEY_STEP = 12
"""Pixels that an arrow key goes."""

ARROWS: dict[int, tuple[int, int]] = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, -1),
    Qt.Key.Key_Down: (0, 1),
}
NEIGHBOURS = 8
DENSITY_UNTIL = 1.3
"""Zoom up to which density contours are painted."""


class MapView(QWidget):
    """Shows the latent map; the mouse chooses places, cells and parts of it.

    Parameters
    ----------
    latent : LatentState
    session : LatentSession
    pictures : LatentPictures
    thumbnails : LatentThumbnails
    brightness : Brightness
    """

    chosen = Signal()
    """Emitted when the place under the mouse was clicked."""
    menuRequested = Signal(object, object)
    """Emitted with the place of a right click, and its point on the screen."""

    def __init__(
        self,
        latent: LatentState,
        session: LatentSession,
        pictures: LatentPictures,
        thumbnails: LatentThumbnails,
        brightness: Brightness,
    ) -> None:
        super().__init__()
        self._latent = latent
        self._session = session
        self._pictures, self._small = pictures, thumbnails
        self._brightness = brightness
        self._frame = MapFrame(1, 1)
        self._shades: Shades | None = None
        self._points: QImage | None = None
        self._contours: list[NDArray[np.float64]] = []
        self._thumbnails: dict[int, QImage] = {}
        self._chosen_ones: tuple[float, NDArray[np.bool_] | None, NDArray[np.int64]] | None = None
        self._message = self._note = ""
        self._active_cell: int | None = None
        self._path_place: Place | None = None
        self._grips: tuple[Grip, ...] = ()
        self._pressed: QPointF | None = None
        self._button = Qt.MouseButton.NoButton
        self._last = QPointF()
        self._moved = False
        self._before: Brush = latent.brush
        self._lasso: list[Place] = []
        self.setMouseTracking(True)
        self._is_ringed = False
        self.setFocusPolicy(Qt.FocusPolicy.WheelFocus)
        self.setAccessibleName("Map of TFs")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        for signal in (
            latent.brushChanged, latent.lassoChanged, latent.hoverChanged, session.placeChanged,
        ):  # fmt: skip
            signal.connect(lambda _value: self.update())
        latent.placesChanged.connect(self.update)
        session.filterChanged.connect(self._take_thumbnails)
        latent.trailChanged.connect(self.update)
        thumbnails.drawn.connect(self._take_thumbnails)
        brightness.changed.connect(self._brighten)

    @property
    def frame(self) -> MapFrame:
        """The part of the map that is in sight."""
        return self._frame

    @property
    def thumbnails_in_sight(self) -> list[int]:
        """Samples whose thumbnails are painted, or would be if they were drawn."""
        map_ = self._session.map
        if map_ is None or self._frame.zoom < THUMBNAILS_FROM:
            return []
        ones = self._far_apart()
        pixels = self._frame.pixels(map_.places[ones])
        half = THUMBNAIL / 2
        size = self._frame.width, self._frame.height
        inside = ((pixels > -half) & (pixels < np.add(size, half))).all(axis=1)
        return [int(index) for index in ones[inside]]

    def show_message(self, text: str) -> None:
        """Show a text in place of the map; nothing for the map."""
        self._message = text
        self.update()

    def show_note(self, text: str) -> None:
        """Show a few words in the lower right corner: how many TFs there are, or what goes on."""
        if text != self._note:
            self._note = text
            self.update()

    def show_map(self) -> None:
        """Show the session's map as a whole."""
        map_ = self._session.map
        self._contours = [] if map_ is None else density_contours(map_.places)
        self._chosen_ones = None
        self._thumbnails.clear()
        self.reset()

    def show_shades(self, shades: Shades) -> None:
        """Colour the points."""
        self._shades = shades
        self._points = None
        self.update()

    def mark_cell(self, cell: int | None) -> None:
        """Mark a cell of the brush, row by row."""
        if cell != self._active_cell:
            self._active_cell = cell
            self.update()

    def mark_path(self, place: Place | None) -> None:
        """Mark where a path has got to."""
        self._path_place = place
        self.update()

    def reset(self) -> None:
        """Show the whole map."""
        self._set_frame(MapFrame(self.width(), self.height()))

    def look_at(self, brush: Brush) -> None:
        """Bring a rectangle into sight, so that it fills about half of the view."""
        left, lower, right, upper = brush
        side = max(right - left, upper - lower, 1e-3)
        frame = MapFrame(
            self.width(), self.height(), center=((left + right) / 2, (lower + upper) / 2)
        )
        wanted = min(frame.width, frame.height) * 0.55 / (side * frame.scale)
        if wanted > self._frame.zoom or not self._is_in_sight(brush):
            self._set_frame(replace(frame, zoom=min(max(wanted, 1.0), 30.0)))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint points, thumbnails and marks."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        # Dark in both themes, as its colours are made for that.
        painter.fillRect(self.rect(), QColor(theme.ON_IMAGE.plot))
        map_ = self._session.map
        if self._message or map_ is None or self._shades is None:
            painter.setPen(QColor(theme.ON_IMAGE.dim))
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            text = self._message or self._note
            painter.drawText(self.rect().adjusted(20, 20, -20, -20), flags, text)
            painter.end()
            return
        painter.setClipRect(self.rect())
        if self._points is None:
            self._points = self._draw_points()
        painter.drawImage(0, 0, self._points)
        if self._frame.zoom <= DENSITY_UNTIL:
            marks.paint_contours(painter, self._frame, self._contours)
        self._paint_thumbnails(painter)
        frame, latent = self._frame, self._latent
        marks.paint_brush(painter, frame, latent.brush, self._active_cell)
        if self._lasso or latent.lasso:
            marks.paint_lasso(painter, frame, self._lasso or latent.lasso or ())
        marks.paint_trail(painter, frame, latent.trail)
        marks.paint_names(painter, frame, latent.places, self._factor)
        if self._session.place is not None:
            code = self._session.present_code
            if code is not None:
                nearest = map_.nearest(code, NEIGHBOURS)
                marks.paint_neighbours(painter, frame, map_.places[nearest])
            marks.paint_present(painter, frame, self._session.place)
        if self._path_place is not None:
            marks.paint_disc(painter, frame, self._path_place, map_.radius / 4)
        if latent.hover is not None and self._pressed is None:
            self._paint_hover(painter, latent.hover, map_.radius)
        marks.paint_legend(painter, frame, self._shades.legend)
        if self._is_ringed:
            paint_ring(painter, self.rect())
        if self._pictures.has_own_codes:
            marks.paint_singular_values(painter, frame, map_.samples.singular_values)
        elif self._note:
            marks.paint_note(painter, frame, self._note)
        painter.end()

    def resizeEvent(self, _event: QResizeEvent) -> None:
        """Keep the middle of the map where it is."""
        self._set_frame(replace(self._frame, width=self.width(), height=self.height()))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grip the brush, begin a new one or a lasso, or pan."""
        if self._pressed is not None:
            # Another button during a drag.
            return
        at = event.position()
        self._pressed, self._last, self._moved = at, at, False
        self._button = event.button()
        self._before = self._latent.brush
        middle = event.button() == Qt.MouseButton.MiddleButton
        if middle or event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self._grips = ("pan",)
        elif event.button() != Qt.MouseButton.LeftButton:
            self._pressed = None
        elif self._latent.tool == "lasso":
            self._grips, self._lasso = ("lasso",), [self._frame.place(at)]
        elif event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self._grips = ("new",)
        else:
            self._grips = self._grips_at(at) or ("new",)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag what is gripped; without a button, say what is under the mouse."""
        at = event.position()
        if self._pressed is None:
            self._show_cursor(at)
            self._hover(at)
            return
        distance = at - self._pressed
        self._moved = self._moved or max(abs(distance.x()), abs(distance.y())) > CLICK_REACH
        if not self._moved:
            return
        if self._grips == ("pan",):
            step = at - self._last
            self._set_frame(self._frame.shifted(step.x(), step.y()))
        elif self._grips == ("lasso",):
            self._lasso.append(self._frame.place(at))
            self.update()
        else:
            self._latent.move_brush(self._dragged(at))
        self._last = at

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag; a press without one chooses the place."""
        at = event.position()
        place = self._frame.place(at)
        if event.button() == Qt.MouseButton.RightButton and self._pressed is None:
            self.menuRequested.emit(place, event.globalPosition().toPoint())
            return
        if event.button() != self._button:
            return
        grips, moved = self._grips, self._moved
        pressed, self._pressed, self._grips = self._pressed, None, ()
        if pressed is None:
            return
        if grips == ("lasso",):
            corners, self._lasso = tuple(self._lasso), []
            self._latent.set_lasso(corners if moved and len(corners) > 2 else None)
            self._latent.set_tool("brush")
        elif grips == ("pan",):
            pass
        elif moved:
            self._latent.finish_brush()
        elif self._session.map is not None and not self._message:
            self._hover(at)
            self.chosen.emit()
        self.update()

    def leaveEvent(self, _event: QEvent) -> None:
        """Nothing is under the mouse any more."""
        self._latent.set_hover(None)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Come closer to what is under the mouse, or move away."""
        notches = event.angleDelta().y() / 120
        self._set_frame(self._frame.zoomed(WHEEL_FACTOR**notches, event.position()))
        self._hover(event.position())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go over the map by arrow keys, take a TF by Enter, come closer and back by + and −."""
        key = event.key()
        place = self._latent.hover or self._session.place or self._frame.center
        at = self._frame.pixel(place)
        if key in ARROWS:
            right, down = ARROWS[key]
            moved = at + QPointF(KEY_STEP * right, KEY_STEP * down)
            self._hover(
                QPointF(
                    min(max(moved.x(), 0.0), float(self.width())),
                    min(max(moved.y(), 0.0), float(self.height())),
                )
            )
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self._latent.hover is not None:
            self.chosen.emit()
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self._set_frame(self._frame.zoomed(WHEEL_FACTOR, at))
        elif key == Qt.Key.Key_Minus:
            self._set_frame(self._frame.zoomed(1 / WHEEL_FACTOR, at))
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show a ring where keys have brought the focus."""
        self._is_ringed = event.reason() in BY_KEYS
        self.update()
        super().focusInEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Show no ring any more."""
        self._is_ringed = False
        self.update()
        super().focusOutEvent(event)

    def sizeHint(self) -> QSize:
        """Return a size at which the whole window fits on a laptop's screen."""
        return QSize(420, 420)

    def _hover(self, at: QPointF) -> None:
        """Say what is under the mouse: a thumbnail's sample, or a place between samples."""
        map_ = self._session.map
        if map_ is None or self._message:
            return
        half = THUMBNAIL / 2
        for index in self.thumbnails_in_sight:
            place = tuple(map_.places[index].tolist())
            offset = self._frame.pixel(place) - at
            if max(abs(offset.x()), abs(offset.y())) <= half and self._thumbnail(index):
                self._latent.set_hover(place, index)
                return
        self._latent.set_hover(self._frame.place(at), closeness=max(self._frame.zoom, 1.0))

    def _paint_hover(self, painter: QPainter, place: Place, radius: float) -> None:
        if self._latent.hover_sample is None:
            marks.paint_disc(painter, self._frame, place, radius / self._latent.closeness)
            return
        at, half = self._frame.pixel(place), THUMBNAIL / 2 + 1
        painter.setPen(QPen(QColor(theme.ON_IMAGE.change), 2.5))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(QRectF(at.x() - half, at.y() - half, 2 * half, 2 * half))

    def _set_frame(self, frame: MapFrame) -> None:
        if frame != self._frame:
            self._frame = frame
            self._points = None
        self._small.want(self.thumbnails_in_sight)
        self.update()

    def _draw_points(self) -> QImage:
        map_, shades = self._session.map, self._shades
        assert map_ is not None and shades is not None
        pixels = self._frame.pixels(map_.places[shades.order])
        radius = RADIUS * min(self._frame.zoom**0.5, 2.5) * 0.8
        size = self._frame.width, self._frame.height
        return draw_points(pixels, shades.colors[shades.order], size, radius)

    def _far_apart(self) -> NDArray[np.int64]:
        """Samples whose thumbnails do not overlap at this zoom, in steps of the wheel."""
        map_, wanted = self._session.map, self._session.wanted
        assert map_ is not None
        level = float(np.floor(np.log(self._frame.zoom) / np.log(WHEEL_FACTOR)))
        known = self._chosen_ones
        if known is None or known[0] != level or known[1] is not wanted:
            scale = replace(self._frame, zoom=WHEEL_FACTOR**level).scale
            some = np.arange(len(map_.codes)) if wanted is None else np.flatnonzero(wanted)
            ones = some[apart(map_.places[some], (THUMBNAIL + 3) / scale)]
            known = self._chosen_ones = level, wanted, ones
        return known[2]

    def _paint_thumbnails(self, painter: QPainter) -> None:
        map_, shades = self._session.map, self._shades
        assert map_ is not None and shades is not None
        half = THUMBNAIL / 2
        for index in self.thumbnails_in_sight:
            picture = self._thumbnail(index)
            if picture is None:
                continue
            at = self._frame.pixel(tuple(map_.places[index].tolist()))
            rect = QRectF(at.x() - half, at.y() - half, THUMBNAIL, THUMBNAIL)
            stale = index not in self._small.images
            painter.setOpacity(0.4 if stale or not shades.shown[index] else 1.0)
            painter.drawImage(rect, picture)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(*shades.colors[index].tolist()), 1.5))
            painter.drawRect(rect)
        painter.setOpacity(1.0)

    def _thumbnail(self, index: int) -> QImage | None:
        if index not in self._thumbnails:
            small = self._small
            image = small.images.get(index, small.stale.get(index))
            if image is None:
                return None
            self._thumbnails[index] = to_qimage(image, self._factor)
        return self._thumbnails[index]

    @property
    def _factor(self) -> float:
        return self._brightness.of(self._pictures.source)

    def _brighten(self) -> None:
        self._thumbnails.clear()
        self.update()

    def _take_thumbnails(self) -> None:
        # What is drawn anew replaces what was stale.
        self._thumbnails.clear()
        self._small.want(self.thumbnails_in_sight)
        self.update()

    def _is_in_sight(self, brush: Brush) -> bool:
        return QRectF(self.rect()).contains(self._frame.rectangle(brush))

    def _grips_at(self, at: QPointF) -> tuple[Grip, ...]:
        """Edges of the brush at a pixel, "move" inside it, nothing outside."""
        rect = self._frame.rectangle(self._latent.brush)
        if not rect.adjusted(-REACH, -REACH, REACH, REACH).contains(at):
            return ()
        grips: list[Grip] = []
        if abs(at.x() - rect.left()) <= REACH:
            grips.append("left")
        elif abs(at.x() - rect.right()) <= REACH:
            grips.append("right")
        if abs(at.y() - rect.bottom()) <= REACH:
            grips.append("lower")
        elif abs(at.y() - rect.top()) <= REACH:
            grips.append("upper")
        return tuple(grips) or ("move",)

    def _dragged(self, at: QPointF) -> Brush:
        """Brush by the drag from the pressed point to a pixel."""
        assert self._pressed is not None
        (ax, ay), (bx, by) = self._frame.place(self._pressed), self._frame.place(at)
        if self._grips == ("new",):
            return min(ax, bx), min(ay, by), max(ax, bx), max(ay, by)
        left, lower, right, upper = self._before
        dx, dy = bx - ax, by - ay
        if self._grips == ("move",):
            return left + dx, lower + dy, right + dx, upper + dy
        left += dx if "left" in self._grips else 0
        right += dx if "right" in self._grips else 0
        lower += dy if "lower" in self._grips else 0
        upper += dy if "upper" in self._grips else 0
        return min(left, right), min(lower, upper), max(left, right), max(lower, upper)

    def _show_cursor(self, at: QPointF) -> None:
        shapes = Qt.CursorShape
        grips = self._grips_at(at)
        shape = shapes.CrossCursor
        if grips in (("left", "lower"), ("right", "upper")):
            shape = shapes.SizeBDiagCursor
        elif grips in (("left", "upper"), ("right", "lower")):
            shape = shapes.SizeFDiagCursor
        elif grips in (("left",), ("right",)):
            shape = shapes.SizeHorCursor
        elif grips in (("lower",), ("upper",)):
            shape = shapes.SizeVerCursor
        self.setCursor(shape)
