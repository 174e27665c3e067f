"""Three slices, or a large one: picture, cross-hair, crop box, and the values under the mouse."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, QLineF, QObject, QPointF, QRectF, QSignalBlocker, Qt, Signal
from PySide6.QtGui import (
    QBrush,
    QColor,
    QCursor,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPen,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QVBoxLayout, QWidget

from app import theme
from app.caption_button import CaptionButton
from app.controls import ElidedLabel, add_action, add_choices, fill
from app.number_box import WholeNumberBox, significant
from app.state.viewer_state import ViewerState
from model.scene import slices
from model.scene.crop import CropBox, least_length
from model.scene.tf_presets import looks_like_hu
from model.scene.transfer_function import Range
from model.scene.volume import Triple, Volume

FAST = 10  # slices of a notch of the wheel with Shift
ZOOM = 1.15  # factor of a notch with Ctrl
LARGEST, MARGIN = 200, 0.06  # largest zoom of a slice; margin around it, as a share of its size
FADED = 3  # divisor of the brightness of voxels that images do not show
GAP = 6.0  # half the gap of the cross-hair in its middle, in pixels
PLACE, PADDING = 6, 8  # distance of the number's box to the corner, and its margin, in pixels
GRAY_PIXELS = 200.0  # pixels of a drag that make the grey window 2.7 times as wide

COLORS: dict[slices.SliceColors, tuple[str, str]] = {
    "gray": ("Grey", "Drag with the right button to change its window"),
    "colors": ("TF", "The TF's colours"),
    "overlay": ("Overlay", "The TF's colours over grey, as opaque as in the TF"),
}

CT_WINDOWS: dict[str, Range] = {
    "&Lung": (-1350, 150), "&Bone": (-500, 1300), "&Soft tissue": (-160, 240), "B&rain": (0, 80),
}  # fmt: skip
"""Radiologists' grey windows, in Hounsfield units."""


class SliceState(QObject):
    """State of the slices beyond the viewer's inputs; :meth:`show` changes it."""

    changed = Signal()
    moved = Signal()  # emitted when the user has moved the cross-hair
    painted = Signal()  # emitted when the user has changed colours or grey window
    hovered = Signal(object)  # emitted with the place under the mouse; None when it leaves

    volume: Volume | None = None
    place: Triple = slices.MIDDLE  # of the cross-hair, in fractions of the volume's extent
    colors: slices.SliceColors = "gray"
    window: Range = (0.0, 1.0)  # values shown in grey, from black to white
    band: Range | None = None  # values that are outlined
    edits_crop = False  # whether the crop box has handles

    def __init__(self, viewer: ViewerState, parent: QObject) -> None:
        super().__init__(parent)
        self.viewer = viewer
        self.marks: list[Callable[[SliceView, QPainter], object]] = []  # painted over each slice

    def show(self, **changes: Any) -> None:
        """Change some of the attributes, by their names."""
        if any(getattr(self, name) != value for name, value in changes.items()):
            vars(self).update(changes)
            self.changed.emit()

    def paint(self, **changes: Any) -> None:
        """Change colours or grey window, as the user wants."""
        self.show(**changes)
        self.painted.emit()

    def move(self, place: Triple) -> None:
        """Move the cross-hair to the voxel nearest to a place."""
        if self.volume is not None:
            self.show(place=slices.place_at(self.volume, slices.voxel_of(self.volume, place)))
            self.moved.emit()

    def scroll(self, axis: int, steps: int) -> None:
        """Step by some slices, in the direction of their axis."""
        if self.volume is not None:
            voxel = list(slices.voxel_of(self.volume, self.place))
            voxel[axis] += steps
            self.move(slices.place_at(self.volume, (voxel[0], voxel[1], voxel[2])))


class SliceView(pg.GraphicsView):  # type: ignore[misc]
    """Shows the slice through the cross-hair across one of the axes.

    The wheel scrolls, ten slices with Shift, and zooms with Ctrl. A left drag moves the cross-hair,
    a middle one or one with Shift pans, a right one changes the grey window.
    """

    _is_fit = False  # whether the whole slice is shown
    _is_hatched = False  # whether some of it is clear

    def __init__(self, state: SliceState, number: int, enlarge: Callable[[int], object]) -> None:
        super().__init__(background=theme.CANVAS)
        self._state, self._number, self._enlarge = state, number, enlarge
        self._crop = state.viewer.crop_input
        self._grid: object = None
        self._drawn: object = None
        self._voxels = QRectF(0, 0, 1, 1)
        """Rectangle of the picture with its outer voxels, whose centers are at 0 and 1."""
        self._notches = 0.0
        self._last: QPointF | None = None
        self._before = state.place
        self._grip: Any = None
        self._box = pg.ViewBox(
            lockAspect=True, enableMouse=False, enableMenu=False, invertY=True, defaultPadding=0
        )
        self._box.disableAutoRange()
        self._box.setLimits(minXRange=1 / LARGEST, maxXRange=LARGEST)
        self.setCentralItem(self._box)
        self._picture = pg.ImageItem(axisOrder="row-major")
        self._box.addItem(self._picture)
        self._rectangle = _crop_rectangle()
        self._rectangle.sigRegionChanged.connect(self._take_crop)
        self._box.addItem(self._rectangle, ignoreBounds=True)
        self.number = WholeNumberBox(self.viewport())
        self.number.move(PLACE, PLACE)
        self.number.lineEdit().setTextMargins(4, 0, 4, 0)
        self.number.valueChanged.connect(self._go_to)
        self.setCacheMode(self.CacheModeFlag.CacheNone)
        self.setMinimumSize(120, 90)
        self.setProperty("role", "slice")
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setFocusPolicy(Qt.FocusPolicy.WheelFocus)
        self.number.setKeyboardTracking(False)

    @property
    def plane(self) -> slices.Plane:
        """The plane of these slices."""
        viewer = self._state.viewer
        return slices.planes_of(viewer.up_axis, viewer.axis_labels)[self._number]

    @property
    def _volume(self) -> Volume:
        volume = self._state.volume
        assert volume is not None
        return volume

    def refresh(self) -> None:
        """Show changes of the state."""
        state, viewer, plane, volume = self._state, self._state.viewer, self.plane, self._volume
        grid = volume.dimensions, volume.spacing, plane
        if grid != self._grid:
            self._grid = grid
            self._start(volume, plane)
        index = slices.voxel_of(volume, state.place)[plane.axis]
        tf = None if state.colors == "gray" else viewer.transfer_function
        paint = slices.SlicePaint.of(state.window, tf, state.colors == "overlay")
        hides, smooth = (viewer.mask_input.value, viewer.clip), viewer.interpolates
        drawn = volume, plane, index, paint, state.band, smooth, hides
        if drawn != self._drawn:
            self._drawn = drawn
            hidden = None if volume.hidden is None else plane.cut(volume.hidden, state.place)
            values, ink = plane.cut(volume.shown, state.place), QColor(theme.ON_IMAGE.visible)
            picture = paint.picture(values, hidden, state.band, ink.rgb() & 0xFFFFFF)
            cut = slices.cut_away(volume, plane, state.place, *hides)
            if cut is not None:
                colors = picture[..., :3]
                np.floor_divide(colors, FADED, out=colors, where=cut[..., None])
            self._is_hatched = hidden is not None
            self.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, smooth)
            self._picture.setImage(picture, autoLevels=False, levels=None)
            self._picture.setRect(self._voxels)
        self.number.show_value(index + 1)
        self._show_crop()
        self.viewport().update()

    def fit(self) -> None:
        """Show the whole slice, also after the view is resized."""
        self._is_fit = True
        self._box.setRange(self._voxels, padding=MARGIN)
        self.viewport().update()

    def place_under(self, position: QPointF) -> Triple | None:
        """Return the place of the slice at a position; None outside the volume."""
        inside = self._voxels.contains(self._box.mapSceneToView(position))
        return self._nearest_place(position) if inside else None

    def position_of(self, place: Triple) -> QPointF:
        """Return the position in the view of a place, as seen across the slices."""
        return self._box.mapViewToScene(QPointF(*self.plane.in_picture(place)))

    def _start(self, volume: Volume, plane: slices.Plane) -> None:
        """Adopt another volume's grid."""
        across = plane.right[0], plane.up[0]
        wide, high = (volume.proportions[axis] for axis in across)
        half = [0.5 / (volume.dimensions[axis] - 1) for axis in across]
        self._voxels = QRectF(0, 0, 1, 1).adjusted(-half[0], -half[1], *half)
        self._box.setAspectLocked(True, ratio=wide / high)
        count, box = volume.dimensions[plane.axis], self.number
        box.setPrefix(f"{plane.name} ")
        box.setSuffix(f" of {count}")
        for part in (box, self):
            part.setAccessibleName(f"{plane.name} slice")
        # As wide as the largest number.
        box.set_limits(1, count)
        box.show_value(count)
        width = box.fontMetrics().horizontalAdvance(box.text()) + 2 * PADDING
        box.setFixedSize(width, box.sizeHint().height())
        self.fit()

    def _show_crop(self) -> None:
        """Draw the crop box where there is one, with handles while it can be dragged."""
        box, edits = self._crop.value, self._state.edits_crop
        self._rectangle.setVisible(box is not None or edits)
        box = box or CropBox()
        low, high = (QPointF(*self.plane.in_picture(place)) for place in (box.low, box.high))
        rect = QRectF(low, high).normalized()
        with QSignalBlocker(self._rectangle):
            self._rectangle.setPos(rect.topLeft(), update=False, finish=False)
            self._rectangle.setSize(rect.size().toTuple(), finish=False)
        for handle in self._rectangle.getHandles():
            handle.setVisible(edits)

    def _take_crop(self, rectangle: Any) -> None:
        """Move the planes of the crop box that were dragged."""
        box, plane, volume = self._crop.value or CropBox(), self.plane, self._volume
        low = rectangle.pos()
        corners = [plane.moved(slices.MIDDLE, at) for at in (low, low + rectangle.size())]
        for axis in (plane.right[0], plane.up[0]):
            least = least_length(volume.dimensions[axis])
            for side, place in enumerate(sorted(corner[axis] for corner in corners)):
                if not math.isclose(place, (box.low, box.high)[side][axis], abs_tol=1e-9):
                    box = box.with_plane(axis, side, place, least)
        self._crop.move(box)

    def _go_to(self, number: int) -> None:
        axis, state = self.plane.axis, self._state
        state.scroll(axis, number - 1 - slices.voxel_of(self._volume, state.place)[axis])

    def _nearest_place(self, position: QPointF) -> Triple:
        at = self._box.mapSceneToView(position)
        return self.plane.moved(self._state.place, (at.x(), at.y()))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep showing the whole slice, unless it was zoomed; report the place under the mouse."""
        super().resizeEvent(event)
        if self._is_fit:
            self.fit()
        if self.underMouse():
            self._state.hovered.emit(self.place_under(self.mapFromGlobal(QPointF(QCursor.pos()))))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Scroll, or zoom to the mouse."""
        event.accept()
        moved, keys = event.angleDelta(), event.modifiers()
        notches = (moved.y() or moved.x()) / 120
        if keys & Qt.KeyboardModifier.ControlModifier:
            self._is_fit = False
            middle, factor = self._box.mapSceneToView(event.position()), ZOOM**-notches
            self._box.scaleBy((factor, factor), center=middle)
            self.viewport().update()
            return
        # Wheels of high resolution report parts of a notch.
        self._notches += notches * (FAST if keys & Qt.KeyboardModifier.ShiftModifier else 1)
        steps = int(self._notches)
        self._notches -= steps
        self._state.scroll(self.plane.axis, steps)
        self._state.hovered.emit(self.place_under(event.position()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Scroll by Page up and Page down, show all by Home; others are the window's."""
        steps = {Qt.Key.Key_PageUp: 1, Qt.Key.Key_PageDown: -1}.get(Qt.Key(event.key()), 0)
        self._state.scroll(self.plane.axis, steps)
        if event.key() == Qt.Key.Key_Home:
            self.fit()
        elif not steps:
            event.ignore()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a drag: of the crop box's handle, of the cross-hair, or of the picture."""
        self._last, self._before = event.position(), self._state.place
        self._grip = self._handle_at(event.position())
        self._drag(event, QPointF())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag, or report the place under the mouse."""
        position = event.position()
        self._state.hovered.emit(self.place_under(position))
        if event.buttons() and self._last is not None:
            moved, self._last = position - self._last, position
            self._drag(event, moved)
        elif self._state.edits_crop:
            shapes = Qt.CursorShape
            is_handle = self._handle_at(position) is not None
            self.setCursor(shapes.SizeAllCursor if is_handle else shapes.CrossCursor)

    def mouseReleaseEvent(self, _event: QMouseEvent) -> None:
        """End a drag."""
        self._last = self._grip = None
        self._crop.finish()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Enlarge the slice, or show all three again; the first click does not count."""
        if event.button() == Qt.MouseButton.LeftButton and not event.modifiers():
            self._state.move(self._before)
            self._enlarge(self._number)

    def leaveEvent(self, event: QEvent) -> None:
        """Report that the mouse has left."""
        super().leaveEvent(event)
        self._state.hovered.emit(None)

    def _drag(self, event: QMouseEvent, moved: QPointF) -> None:
        state, buttons = self._state, event.buttons()
        if self._grip is not None:
            self._rectangle.movePoint(self._grip, event.position(), finish=False, coords="scene")
        elif buttons & Qt.MouseButton.RightButton:
            wider, higher = math.exp(moved.x() / GRAY_PIXELS), -moved.y() / GRAY_PIXELS
            whole = self._volume.scalar_range
            state.paint(window=slices.gray_window(state.window, whole, wider, higher))
        elif buttons & Qt.MouseButton.MiddleButton or (
            event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        ):
            self._is_fit = self._is_fit and moved.isNull()
            wide, high = self._box.viewPixelSize()
            self._box.translateBy(x=-moved.x() * wide, y=-moved.y() * high)
            self.viewport().update()
        else:
            state.move(self._nearest_place(event.position()))

    def _handle_at(self, position: QPointF) -> Any:
        """The crop box's handle at a position; None without one."""
        handles = self._rectangle.getHandles() if self._state.edits_crop else ()
        return next((item for item in self.items(position.toPoint()) if item in handles), None)

    def drawBackground(self, painter: QPainter, rect: QRectF) -> None:
        """Hatch clear places, where nothing was measured."""
        painter.fillRect(rect, QColor(theme.CANVAS))
        if self._is_hatched:
            shown = self._box.mapViewToScene(self._voxels).boundingRect()
            hatch = QBrush(QColor(theme.ON_IMAGE.line), Qt.BrushStyle.BDiagPattern)
            painter.fillRect(shown.intersected(QRectF(self.rect())), hatch)

    def drawForeground(self, painter: QPainter, _rect: QRectF) -> None:
        """Draw the cross-hair, and the letters at the edges."""
        at, wide, high = self.position_of(self._state.place), self.width(), self.height()
        color = QColor(theme.ON_IMAGE.attention)
        color.setAlpha(170)
        painter.setPen(QPen(color, 1))
        x, y = at.x(), at.y()
        level = QLineF(0, y, x - GAP, y), QLineF(x + GAP, y, wide, y)
        painter.drawLines([*level, QLineF(x, 0, x, y - GAP), QLineF(x, y + GAP, x, high)])
        inside, sides = self.rect().adjusted(4, 2, -4, -2), Qt.AlignmentFlag
        plate = QColor(theme.CANVAS)
        plate.setAlpha(150)
        painter.setPen(QColor(theme.ON_IMAGE.dim))
        places = sides.AlignLeft, sides.AlignRight, sides.AlignBottom, sides.AlignTop
        middles = 2 * (sides.AlignVCenter,) + 2 * (sides.AlignHCenter,)
        # In a narrow slice, the letter at the top stands next to the number's box.
        right_of_box = 2 * (self.number.geometry().right() + PADDING) - wide
        for text, side, middle in zip(self.plane.edges, places, middles, strict=True):
            place = side | middle
            area = inside.adjusted(max(right_of_box, 0), 0, 0, 0) if side == places[3] else inside
            # Otherwise the cross-hair would cross out the letters in the middle.
            painter.fillRect(painter.boundingRect(area, place, text), plate)
            painter.drawText(area, place, text)
        if self.hasFocus():
            painter.setPen(QPen(QColor(theme.ON_IMAGE.change), 1))
            painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        for paint in self._state.marks:
            paint(self, painter)


class SlicesColumn(QWidget):
    """Shows three slices; a double click makes one of them large."""

    large: int | None = None  # number of the slice that is shown alone

    def __init__(self, state: SliceState, enlarge: Callable[[int], object]) -> None:
        super().__init__()
        self._state = state
        self._under: Triple | None = None
        self.views = [SliceView(state, number, enlarge) for number in range(3)]
        self.button = CaptionButton()
        menu = self.button.add_menu()
        self.choices = add_choices(menu, COLORS, lambda colors: state.paint(colors=colors))
        menu.addSeparator()
        add_action(menu, "Window of &all values", self._choose_gray)
        self._ct = [
            add_action(menu, f"{name}\t{_window_text(window)}", partial(self._choose_gray, window))
            for name, window in CT_WINDOWS.items()
        ]
        self.value, self.where = ElidedLabel(), ElidedLabel()
        self.where.setProperty("role", "dim")
        foot = fill(QHBoxLayout(), self.button, margins=(4, 2, 6, 2), spacing=6)
        foot.addLayout(fill(QVBoxLayout(), self.value, self.where), 1)
        self._rows, others = QVBoxLayout(), fill(QVBoxLayout(), *self.views[1:], spacing=1)
        fill(QVBoxLayout(self), fill(self._rows, self.views[0], others, spacing=1), foot, spacing=1)
        self._rows.setStretch(0, 1)
        state.changed.connect(self.refresh)
        state.viewer.inputsChanged.connect(state.viewer.refreshes.soon(self.refresh))
        state.viewer.navigationChanged.connect(self.refresh)
        state.hovered.connect(self._say)
        state.painted.connect(self._say_window)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Put the other slices to the right of the first, where all become larger by that."""
        super().resizeEvent(event)
        self.enlarge(self.large)

    def enlarge(self, large: int | None) -> None:
        """Show one slice alone, or all three for None."""
        self.large = large
        for number, view in enumerate(self.views):
            view.setVisible(large in (None, number))
        widest = max(view.number.width() + 2 * PLACE for view in self.views)
        is_wide = self.width() > max(2 * self.height() / 3, 2 * widest)
        directions = QBoxLayout.Direction
        self._rows.setDirection(directions.LeftToRight if is_wide else directions.TopToBottom)
        # The layout of hidden slices would take its share, too.
        self._rows.setStretch(1, 0 if large is not None else 1 if is_wide else 2)

    def refresh(self) -> None:
        """Show changes of the state, unless the slices are hidden."""
        if self.isHidden() or self._state.volume is None:
            return
        for view in self.views:
            view.refresh()
        self.choices[self._state.colors].setChecked(True)
        self.button.title = COLORS[self._state.colors][0]
        volume = self._state.volume
        is_ct = volume.scale == "linear" and looks_like_hu(volume.data_range, volume.units)
        for action, window in zip(self._ct, CT_WINDOWS.values(), strict=True):
            action.setVisible(is_ct)
            action.setCheckable(True)
            action.setChecked(window == self._state.window and self._state.colors != "colors")
        self.button.setToolTip(_window_text(self._state.window))
        self._say(self._under)

    def _choose_gray(self, window: Range | None = None) -> None:
        state = self._state
        if state.volume is not None:
            colors = "overlay" if state.colors == "overlay" else "gray"
            state.paint(window=window or state.volume.scalar_range, colors=colors)

    def _say_window(self) -> None:
        if self._state.colors != "colors":
            self.where.full_text = _window_text(self._state.window)

    def _say(self, place: Triple | None) -> None:
        """Show value and place under the mouse, or at the cross-hair."""
        volume = self._state.volume
        if volume is None:
            return
        self._under, place = place, place or self._state.place
        value = slices.stored_at(volume, place)
        said, name = "nothing measured", ""
        if value is not None:
            number = significant(value, 9 if value.is_integer() else 5)
            said = f"{number} {volume.units}" if volume.units else f"value {number}"
            name = self._state.viewer.label_name(value)
        voxel = f"voxel {', '.join(str(n + 1) for n in slices.voxel_of(volume, place))}"
        step, found = min(volume.spacing), slices.coordinates(volume, place)
        numbers = [f"{axis} {_written(number, step)}" for axis, number in found]
        where = "  ".join([*numbers, volume.file.spacing_unit]).rstrip()
        # Two lines in any case, so that they are level with the menu.
        self.value.full_text = "  ".join(filter(None, (said, name, voxel if where else "")))
        self.where.full_text = where or voxel


def _window_text(window: Range) -> str:
    low, high = window
    return f"window {significant(high - low, 3)}  level {significant((low + high) / 2, 3)}"


def _crop_rectangle() -> Any:
    """Return the crop box in one slice, in the units of its picture."""
    pen = pg.mkPen(theme.ON_IMAGE.text, width=1.2)
    options = {"movable": False, "rotatable": False, "pen": pen, "handlePen": pen}
    rectangle = pg.ROI((0, 0), (1, 1), maxBounds=QRectF(0, 0, 1, 1), **options)
    for x, y in ((0, 0), (0, 0.5), (0, 1), (0.5, 0), (0.5, 1), (1, 0), (1, 0.5), (1, 1)):
        # A handle's menu, which is never used, would outlive the handle.
        rectangle.addScaleHandle((x, y), (1 - x, 1 - y)).menu.deleteLater()
    return rectangle


def _written(coordinate: float, step: float) -> str:
    """Write a coordinate with four digits, or enough to tell neighbouring voxels apart."""
    digits = 2 + int(math.log10(max(abs(coordinate) / step, 1)))
    return significant(coordinate, max(4, digits))
