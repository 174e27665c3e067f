"""The map: points and marks, with brush, hovering, panning and zooming."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QWheelEvent,
)

from app import theme
from app.controls import ARROWS, CLICK_REACH, Painted
from app.image_view.image_canvas import KeyedWidget
from app.latent_browser import map_marks as marks
from app.latent_browser.map_marks import WHEEL_FACTOR, Grip, MapFrame, dragged, grips_at
from app.state.latent_session import LatentSession, LatentState
from model.latent.latent_map import CELLS, Brush

KEY_STEP = 12  # pixels that an arrow key goes


class MapView(KeyedWidget):
    """Shows the latent map; the mouse chooses places, cells and parts of it."""

    chosen = Signal()  # when the place under the mouse was clicked

    message = Painted("")  # in place of the map
    note = Painted("")  # in the lower right corner: how many TFs there are, or what goes on
    active_cell = Painted[int | None](None)  # of the brush, row by row
    frame = Painted(MapFrame(1, 1), "_draw_anew")  # the part of the map that is in sight
    shades = Painted[marks.Shades | None](None, "_draw_anew")  # colours of the points

    def __init__(self, latent: LatentState, session: LatentSession) -> None:
        super().__init__()
        self._latent = latent
        self._session = session
        self._points: QImage | None = None
        self._grips: tuple[Grip, ...] = ()
        self._pressed: QPointF | None = None
        self._button = Qt.MouseButton.NoButton
        self._last = QPointF()
        self._moved = False
        self._before: Brush = latent.brush
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.WheelFocus)
        self.setAccessibleName("Map of TFs")
        for signal in (latent.brushChanged, latent.hoverChanged, session.marksChanged):
            signal.connect(lambda *_: self.update())

    def reset(self) -> None:
        """Show the whole map."""
        self.frame = MapFrame(self.width(), self.height())

    def look_at(self, brush: Brush) -> None:
        """Zoom to a rectangle, so that it fills about half of the view."""
        left, lower, right, upper = brush
        side = max(right - left, upper - lower, 1e-3)
        middle = (left + right) / 2, (lower + upper) / 2
        frame = MapFrame(self.width(), self.height(), center=middle)
        wanted = min(frame.width, frame.height) * 0.55 / (side * frame.scale)
        is_in_sight = QRectF(self.rect()).contains(self.frame.rectangle(brush))
        if wanted > self.frame.zoom or not is_in_sight:
            self.frame = replace(frame, zoom=min(max(wanted, 1.0), 30.0))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint points and marks."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        # Dark in both themes, to suit the colours.
        painter.fillRect(self.rect(), QColor(theme.ON_IMAGE.plot))
        map_ = self._session.map
        if self.message or map_ is None or self.shades is None:
            painter.setPen(QColor(theme.ON_IMAGE.dim))
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            text = self.message or self.note
            painter.drawText(self.rect().adjusted(20, 20, -20, -20), flags, text)
            return
        painter.setClipRect(self.rect())
        if self._points is None:
            self._points = self._drawn_points(map_.places, self.shades)
        painter.drawImage(0, 0, self._points)
        frame, latent = self.frame, self._latent
        marks.paint_brush(painter, frame, latent.brush, self.active_cell)
        different = self._session.different
        # More are first drawn, then chosen from.
        if different is not None and len(different) <= CELLS**2:
            marks.paint_different(painter, frame, map_.places[different])
        if self._session.place is not None:
            marks.paint_present(painter, frame, self._session.place)
        if latent.hover is not None and self._pressed is None:
            marks.paint_disc(painter, frame, latent.hover, map_.radius / latent.closeness)
        marks.paint_legend(painter, frame, self.shades)
        self._paint_ring(painter)
        if self.note:
            marks.paint_note(painter, frame, self.note)

    def resizeEvent(self, _event: QResizeEvent) -> None:
        """Keep the middle of the map where it is."""
        self.frame = replace(self.frame, width=self.width(), height=self.height())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grip the brush, begin a new one, or pan."""
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
        elif event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self._grips = ("new",)
        else:
            self._grips = grips_at(self.frame, self._before, at) or ("new",)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag what is gripped; without a button, say what is under the mouse."""
        at = event.position()
        if self._pressed is None:
            grips = grips_at(self.frame, self._latent.brush, at)
            self.setCursor(marks.CURSORS.get(grips, Qt.CursorShape.CrossCursor))
            self._hover(at)
            return
        distance = at - self._pressed
        self._moved = self._moved or max(abs(distance.x()), abs(distance.y())) > CLICK_REACH
        if not self._moved:
            return
        if self._grips == ("pan",):
            step = at - self._last
            self.frame = self.frame.shifted(step.x(), step.y())
        else:
            start, end = self.frame.place(self._pressed), self.frame.place(at)
            self._latent.move_brush(dragged(self._grips, self._before, start, end))
        self._last = at

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag; a press without one chooses the place."""
        at = event.position()
        if event.button() != self._button:
            return
        grips, moved = self._grips, self._moved
        pressed, self._pressed, self._grips = self._pressed, None, ()
        if pressed is None:
            return
        if grips == ("pan",):
            pass
        elif moved:
            self._latent.finish_brush()
        elif self._session.map is not None and not self.message:
            self._hover(at)
            self.chosen.emit()
        self.update()

    def leaveEvent(self, _event: QEvent) -> None:
        """Forget the place under the mouse."""
        self._latent.set_hover(None)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom in to the place under the mouse, or out."""
        notches = event.angleDelta().y() / 120
        self.frame = self.frame.zoomed(WHEEL_FACTOR**notches, event.position())
        self._hover(event.position())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go over the map by arrow keys, take a TF by Enter, come closer and back by + and −."""
        key = event.key()
        place = self._latent.hover or self._session.place or self.frame.center
        at = self.frame.pixel(place)
        if key in ARROWS:
            right, down = ARROWS[key]
            x = min(max(at.x() + KEY_STEP * right, 0.0), float(self.width()))
            y = min(max(at.y() + KEY_STEP * down, 0.0), float(self.height()))
            self._hover(QPointF(x, y))
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self._latent.hover is not None:
            self.chosen.emit()
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self.frame = self.frame.zoomed(WHEEL_FACTOR, at)
        elif key == Qt.Key.Key_Minus:
            self.frame = self.frame.zoomed(1 / WHEEL_FACTOR, at)
        else:
            super().keyPressEvent(event)

    def _hover(self, at: QPointF) -> None:
        if self._session.map is not None and not self.message:
            self._latent.set_hover(self.frame.place(at), max(self.frame.zoom, 1.0))

    def _draw_anew(self) -> None:
        self._points = None
        self.update()

    def _drawn_points(self, places: NDArray[np.float32], shades: marks.Shades) -> QImage:
        pixels = self.frame.pixels(places[shades.order])
        radius = marks.RADIUS * min(self.frame.zoom**0.5, 2.5) * 0.8
        size = self.frame.width, self.frame.height
        return marks.draw_points(pixels, shades.colors[shades.order], size, radius)
