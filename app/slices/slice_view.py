"""One slice: its picture, the cross-hair and the crop box over it, and what the mouse does."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPointF, QRectF, QSignalBlocker, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPen,
    QResizeEvent,
    QWheelEvent,
)

from app import theme
from app.number_box import WholeNumberBox
from app.slices.slice_state import SliceState
from model.scene.crop import CropBox
from model.scene.slices import Plane, gray_window, voxel_of
from model.scene.volume import Triple

FAST = 10  # slices of a notch of the wheel with Shift
ZOOM = 1.15  # factor of a notch with Ctrl
NEAREST = 200  # the most by which a picture is enlarged
GAP = 6.0  # half the gap of the cross-hair in its middle, in pixels
PLACE, PADDING = 6, 8  # distance of the number's box to the corner, and its margin, in pixels
GRAY_PIXELS = 200.0  # pixels of a drag that make the window of gray 2.7 times as wide


class _Picture(pg.ImageItem):  # type: ignore[misc]
    """A picture that is smoothed where there are values between voxels."""

    smooth = True

    def paint(self, painter: QPainter, *arguments: Any) -> None:
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, self.smooth)
        super().paint(painter, *arguments)


class _CropRectangle(pg.ROI):  # type: ignore[misc]
    """The crop box in one slice, in the units of its picture."""

    def __init__(self, bounds: QRectF) -> None:
        pen = pg.mkPen(theme.ON_IMAGE.text, width=1.2)
        super().__init__(
            (0, 0), (1, 1), maxBounds=bounds, movable=False, rotatable=False, pen=pen,
            handlePen=pen, handleHoverPen=pg.mkPen(theme.ON_IMAGE.change, width=2),
        )  # fmt: skip
        for x in (0.0, 0.5, 1.0):
            for y in (0.0, 0.5, 1.0):
                if (x, y) != (0.5, 0.5):
                    # Its menu would outlive it.
                    self.addScaleHandle((x, y), (1 - x, 1 - y)).menu.deleteLater()

    def show_box(self, rect: QRectF, has_handles: bool) -> None:
        with QSignalBlocker(self):
            self.setPos(rect.topLeft(), update=False, finish=False)
            self.setSize(rect.size().toTuple(), finish=False)
        for handle in self.getHandles():
            handle.setVisible(has_handles)


class SliceView(pg.GraphicsView):  # type: ignore[misc]
    """Shows the slice through the cross-hair across one of the three axes.

    The wheel scrolls, ten slices with Shift, and zooms with Ctrl. A left drag moves the cross-hair,
    a middle one or one with Shift pans, a right one changes the window of gray.
    """

    _is_fit = False  # whether all of the slice is shown

    def __init__(
        self,
        state: SliceState,
        number: int,
        crop: tuple[Callable[[CropBox], object], Callable[[], object]],
        enlarge: Callable[[SliceView], object],
    ) -> None:
        super().__init__(background=theme.CANVAS)
        self._state, self._number, self._enlarge = state, number, enlarge
        self._move_crop, self._finish_crop = crop
        self._size = QRectF(0, 0, 1, 1)
        self._pixel = 0.0, 0.0
        self._notches = 0.0
        self._last: QPointF | None = None
        self._before: Triple | None = None
        self._grip: Any = None
        self._box = pg.ViewBox(
            lockAspect=True, enableMouse=False, enableMenu=False, invertY=True, defaultPadding=0
        )
        self._box.disableAutoRange()
        self.setCentralItem(self._box)
        self.setCacheMode(self.CacheModeFlag.CacheNone)
        self.setMinimumSize(120, 90)
        self._picture = _Picture(axisOrder="row-major")
        self._box.addItem(self._picture)
        self._rectangle: _CropRectangle | None = None
        self.number = WholeNumberBox(self.viewport())
        self.number.move(PLACE, PLACE)
        self.number.valueChanged.connect(self._go_to)
        self.setProperty("role", "slice")
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setAccessibleName("Slice")

    @property
    def plane(self) -> Plane:
        """Which slices these are."""
        return self._state.planes[self._number]

    def show_volume(self) -> None:
        """Show another volume, or the same one along other axes."""
        volume, plane = self._state.volume, self.plane
        if volume is None:
            return
        # Not in the data's units: some are so small that Qt would round them to nothing.
        sides = [volume.proportions[axis] for axis, _sign in (plane.right, plane.up)]
        count = volume.dimensions[plane.axis]
        axis = "xyz"[plane.axis]
        self._size = QRectF(0, 0, *sides)
        wide, high = plane.right[0], plane.up[0]
        self._pixel = (
            sides[0] / (volume.dimensions[wide] - 1),
            sides[1] / (volume.dimensions[high] - 1),
        )
        self.number.setPrefix(f"{axis} " if plane.name == axis else f"{plane.name}  {axis} ")
        self.number.setSuffix(f" of {count - 1}")
        self.number.setAccessibleName(f"{plane.name} slice")
        self.setAccessibleName(f"{plane.name} slice of the volume")
        # As wide as its largest number.
        self.number.set_limits(0, count - 1)
        with QSignalBlocker(self.number):
            self.number.setValue(count - 1)
        width = self.number.fontMetrics().horizontalAdvance(self.number.text())
        self.number.setFixedSize(width + 2 * PADDING, self.number.sizeHint().height())
        self._picture.smooth = self._state.smooth
        if self._rectangle is not None:
            self._box.removeItem(self._rectangle)
            self._rectangle = None
        self.show_slice()
        self.show_crop()
        self.fit()

    def show_slice(self) -> None:
        """Show the present slice in the present colours."""
        volume, place, plane = self._state.volume, self._state.place, self.plane
        if volume is None:
            return
        missing = None
        if volume.missing is not None and not volume.draws_missing:
            missing = plane.cut(volume.missing, place)
        ink = QColor(theme.ON_IMAGE.visible)
        values = plane.cut(volume.voxels, place)
        picture = self._state.paint.picture(values, missing, self._state.band, ink.rgb())
        self._picture.setImage(picture, autoLevels=False, levels=None)
        wide, high = self._pixel
        self._picture.setRect(self._size.adjusted(-wide / 2, -high / 2, wide / 2, high / 2))
        with QSignalBlocker(self.number):
            self.number.setValue(voxel_of(volume, place)[plane.axis])
        self.viewport().update()

    def show_crop(self) -> None:
        """Draw the crop box, if there is one or it can be dragged."""
        box, edits = self._state.crop, self._state.edits_crop
        if box is None and not edits:
            if self._rectangle is not None:
                self._rectangle.hide()
            return
        if self._rectangle is None:
            self._rectangle = _CropRectangle(self._size)
            self._box.addItem(self._rectangle, ignoreBounds=True)
            self._rectangle.sigRegionChanged.connect(self._take_crop)
        self._rectangle.show()
        box = box or CropBox()
        corners = [QPointF(*self.plane.in_picture(corner)) for corner in (box.low, box.high)]
        wide, high = self._size.width(), self._size.height()
        corners = [QPointF(wide * corner.x(), high * corner.y()) for corner in corners]
        self._rectangle.show_box(QRectF(*corners).normalized(), edits)

    def fit(self) -> None:
        """Show all of the slice, also when the view has another size."""
        self._is_fit = True
        self._box.setRange(self._size, padding=0.06)
        self.viewport().update()

    def place_at(self, position: QPointF) -> Triple | None:
        """Return the place of the slice at a position; None outside the volume."""
        at = self._box.mapSceneToView(position)
        (wide, high), whole = self._pixel, self._size
        if not whole.adjusted(-wide / 2, -high / 2, wide / 2, high / 2).contains(at):
            return None
        shares = at.x() / whole.width(), at.y() / whole.height()
        return self.plane.moved(self._state.place, shares)

    def position_of(self, place: Triple) -> QPointF:
        """Return the position in the view of a place, as seen across the slices."""
        x, y = self.plane.in_picture(place)
        at = QPointF(x * self._size.width(), y * self._size.height())
        return self._box.mapViewToScene(at)

    def _go_to(self, number: int) -> None:
        volume = self._state.volume
        if volume is not None:
            here = voxel_of(volume, self._state.place)[self.plane.axis]
            self._state.scroll(self.plane, number - here)

    def _take_crop(self, rectangle: _CropRectangle) -> None:
        low, size = rectangle.pos(), rectangle.size()
        wide, high = self._size.width(), self._size.height()
        first = low.x() / wide, low.y() / high
        last = (low.x() + size.x()) / wide, (low.y() + size.y()) / high
        self._move_crop(self._state.cropped(self.plane, first, last))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Go on to show all of the slice, unless it was zoomed."""
        super().resizeEvent(event)
        if self._is_fit:
            self.fit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Scroll, or zoom to the mouse."""
        event.accept()
        moved, keys = event.angleDelta(), event.modifiers()
        notches = (moved.y() or moved.x()) / 120
        if keys & Qt.KeyboardModifier.ControlModifier:
            wide, _high = self._box.viewPixelSize()
            least = self._size.width() / max(self.width(), 1) / NEAREST
            if notches < 0 or wide > least:
                self._is_fit = False
                middle = self._box.mapSceneToView(event.position())
                self._box.scaleBy((ZOOM**-notches, ZOOM**-notches), center=middle)
                self.viewport().update()
            return
        # Wheels of high resolution report parts of a notch.
        self._notches += notches * (FAST if keys & Qt.KeyboardModifier.ShiftModifier else 1)
        steps = int(self._notches)
        self._notches -= steps
        self._state.scroll(self.plane, steps)
        self._state.hovered.emit(self.place_at(event.position()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Scroll by Page up and Page down, show all by Home."""
        steps = {Qt.Key.Key_PageUp: 1, Qt.Key.Key_PageDown: -1}.get(Qt.Key(event.key()))
        if steps is not None:
            self._state.scroll(self.plane, steps)
        elif event.key() == Qt.Key.Key_Home:
            self.fit()
        else:
            # Not to the scene, which would keep the window's keys.
            event.ignore()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a drag: of the crop box's handle, of the cross-hair, or of the picture."""
        event.accept()
        self._last, self._before = event.position(), self._state.place
        self._grip = self._crop_handle_at(event.position())
        if self._gesture(event) == "place":
            self._drag_place(event.position())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag, or say what is under the mouse."""
        position = event.position()
        if event.buttons() and self._last is not None:
            moved, gesture = position - self._last, self._gesture(event)
            self._last = position
            if gesture == "crop" and self._rectangle is not None:
                self._rectangle.movePoint(self._grip, position, finish=False, coords="scene")
            elif gesture == "place":
                self._drag_place(position)
            elif gesture == "pan":
                wide, high = self._box.viewPixelSize()
                self._is_fit = False
                self._box.translateBy(x=-moved.x() * wide, y=-moved.y() * high)
                self.viewport().update()
            else:
                self._drag_gray(moved)
        elif self._state.edits_crop:
            is_handle = self._crop_handle_at(position) is not None
            shapes = Qt.CursorShape
            self.setCursor(shapes.SizeAllCursor if is_handle else shapes.CrossCursor)
        self._state.hovered.emit(self.place_at(position))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag."""
        event.accept()
        if self._grip is not None:
            self._finish_crop()
        self._last = self._grip = None

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Make the slice large, or all of them small again; the first click was none."""
        event.accept()
        if event.button() == Qt.MouseButton.LeftButton and not event.modifiers():
            if self._before is not None:
                self._state.move(self._before)
            self._enlarge(self)

    def leaveEvent(self, event: QEvent) -> None:
        """Say that nothing is under the mouse."""
        super().leaveEvent(event)
        self._state.hovered.emit(None)

    def _gesture(self, event: QMouseEvent) -> str:
        buttons = event.buttons()
        if self._grip is not None:
            return "crop"
        if buttons & Qt.MouseButton.RightButton:
            return "gray"
        shift = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        return "pan" if buttons & Qt.MouseButton.MiddleButton or shift else "place"

    def _drag_place(self, position: QPointF) -> None:
        at = self._box.mapSceneToView(position)
        shares = at.x() / self._size.width(), at.y() / self._size.height()
        self._state.move(self.plane.moved(self._state.place, shares))

    def _drag_gray(self, moved: QPointF) -> None:
        """Widen the window of gray to the right; downwards, brighten."""
        state = self._state
        if state.volume is not None:
            wider, higher = math.exp(moved.x() / GRAY_PIXELS), -moved.y() / GRAY_PIXELS
            state.set_window(gray_window(state.window, state.volume.scalar_range, wider, higher))

    def _crop_handle_at(self, position: QPointF) -> Any:
        """The crop rectangle's handle at a position; None without one."""
        handles = self._rectangle.getHandles() if self._state.edits_crop and self._rectangle else ()
        return next((item for item in self.items(position.toPoint()) if item in handles), None)

    def drawBackground(self, painter: QPainter, rect: QRectF) -> None:
        """Hatch what is clear: nothing was measured there."""
        painter.fillRect(rect, QColor(theme.CANVAS))
        volume = self._state.volume
        if volume is not None and volume.missing is not None and not volume.draws_missing:
            shown = self._box.mapViewToScene(self._size).boundingRect()
            hatch = QBrush(QColor(theme.ON_IMAGE.line), Qt.BrushStyle.BDiagPattern)
            painter.fillRect(shown.intersected(QRectF(self.rect())), hatch)

    def drawForeground(self, painter: QPainter, _rect: QRectF) -> None:
        """Draw the cross-hair, and the letters at the edges."""
        if self._state.volume is None:
            return
        at, wide, high = self.position_of(self._state.place), self.width(), self.height()
        color = QColor(theme.ON_IMAGE.attention)
        color.setAlpha(170)
        painter.setPen(QPen(color, 1))
        x, y = at.x(), at.y()
        for start, end in (
            ((0, y), (x - GAP, y)), ((x + GAP, y), (wide, y)),
            ((x, 0), (x, y - GAP)), ((x, y + GAP), (x, high)),
        ):  # fmt: skip
            painter.drawLine(QPointF(*start), QPointF(*end))
        inside = self.rect().adjusted(4, 2, -4, -2)
        left, right, bottom, top = self.plane.edges
        flags = Qt.AlignmentFlag
        plate = QColor(theme.CANVAS)
        plate.setAlpha(150)
        painter.setPen(QColor(theme.ON_IMAGE.dim))
        for text, side in (
            (left, flags.AlignLeft | flags.AlignVCenter),
            (right, flags.AlignRight | flags.AlignVCenter),
            (bottom, flags.AlignHCenter | flags.AlignBottom),
            (top, flags.AlignHCenter | flags.AlignTop),
        ):
            # Else the cross-hair would cross out the letters in the middle.
            painter.fillRect(painter.boundingRect(inside, side, text), plate)
            painter.drawText(inside, side, text)
