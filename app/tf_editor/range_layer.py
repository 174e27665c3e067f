"""The TF's scalar range in the plots: two draggable lines, and grey beyond them."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from PySide6.QtCore import QEvent, QObject, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPen, QStatusTipEvent
from PySide6.QtWidgets import QApplication, QGraphicsRectItem, QStyleOptionGraphicsItem, QWidget

from app import theme
from app.state.viewer_state import ViewerState
from app.tf_editor.handles import DragHandle, is_hovered
from app.tf_editor.plot_area import PlotArea
from model.scene.ranges import fit_to_range, range_text, stretch_to_range, value_text
from model.scene.tf_emphasis import cut_to
from model.scene.transfer_function import Range, TransferFunction

SMALL_RANGE = 0.2  # share of all values below which a range is hard to edit
LEAST_DISTANCE = 0.004  # least distance of the lines after a drag, as a share of the plot's width

_REACH = 5.0
_GRIP = 7.0, 22.0  # width and height of the grips, in pixels
_TIP = (
    "Drag to stretch the TF to another range, like window and level.\nWith Ctrl, values "
    "beyond the mouse become transparent."
)


class RangeLine(DragHandle):
    """A vertical line as high as the plot, with a grip at its top, outside the range."""

    def __init__(
        self,
        outwards: int,
        drag: Callable[[float, float], object],
        release: Callable[[], object],
        press: Callable[[bool], object],
    ) -> None:
        super().__init__("line", drag, release, press)
        left = -_GRIP[0] if outwards < 0 else 0.0
        self._grip_box = QRectF(left, 0.0, *_GRIP)
        self.setCursor(Qt.CursorShape.SplitHCursor)
        self.setToolTip(_TIP)
        # Below the handles of modes and points, which may be at the same position.
        self.setZValue(70)
        self._height = 0.0

    def sceneEvent(self, event: QEvent) -> bool:
        """Name its keys in the status line while the mouse is over it."""
        hover = QEvent.Type.GraphicsSceneHoverEnter, QEvent.Type.GraphicsSceneHoverLeave
        if event.type() in hover:
            area = "Line at an end of the TF" * (event.type() == hover[0])
            QApplication.sendEvent(self.scene().views()[0].window(), QStatusTipEvent(area))
        return super().sceneEvent(event)

    def set_height(self, height: float) -> None:
        """Set the height of the plot, in pixels."""
        self.prepareGeometryChange()
        self._height = height

    def boundingRect(self) -> QRectF:
        """Return the area that is painted and reacts to the mouse, in pixels."""
        grip = self._grip_box
        left, right = min(-_REACH, grip.left()), max(_REACH, grip.right())
        return QRectF(left, -self._height, right - left, self._height)

    def paint(
        self, painter: QPainter, option: QStyleOptionGraphicsItem, _widget: QWidget | None = None
    ) -> None:
        """Draw the line and its grip."""
        color = QColor(theme.CHANGE if is_hovered(option) else theme.DIM)
        painter.setPen(QPen(color, 1.0))
        painter.drawLine(0, 0, 0, -int(self._height))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(color)
        painter.drawRoundedRect(self._grip_box.translated(0.0, -self._height), 2, 2)


class RangeLayer(QObject):
    """Draws the range of the state's TF and edits it by drags."""

    def __init__(self, area: PlotArea, state: ViewerState) -> None:
        super().__init__(area)
        self._area = area
        self._state = state
        self._before, self._cuts = state.transfer_function, False
        self._cut: tuple[TransferFunction, TransferFunction] | None = None
        """The TF whose range was set last: after that and before."""
        self.lines = [
            RangeLine(side, partial(self._drag, end), self._finish, self._begin)
            for end, side in enumerate((-1, 1))
        ]
        for line in self.lines:
            area.opacity.addItem(line, ignoreBounds=True)
        self._shades = [(_add_shade(area.opacity), _add_shade(area.strip)) for _ in range(2)]
        self.recolor()
        self.refresh()

    def refresh(self) -> None:
        """Place the lines and the grey beyond them."""
        for end, value in enumerate(self._state.scalar_range):
            place = self._area.axis.place(value)
            self.lines[end].setPos(place, 0.0)
            self.lines[end].setVisible(0.0 <= place <= 1.0)
            left, right = (0.0, min(place, 1.0)) if end == 0 else (max(place, 0.0), 1.0)
            for shade in self._shades[end]:
                shade.setRect(left, 0.0, max(right - left, 0.0), shade.rect().height())
                shade.setVisible(right > left)

    def show_range(self, fill: bool = False) -> None:
        """Show all values, or only those around the TF's range if it is a small part of them."""
        self._area.include(self._state.scalar_range, self._state.scale)
        axis = self._area.axis.showing(self._area.axis.full)
        low, high = axis.places(self._state.scalar_range)
        if fill or high - low < SMALL_RANGE:
            room = (high - low) / 4
            ends = axis.values([max(low - room, 0.0), min(high + room, 1.0)])
            axis = axis.showing((float(ends[0]), float(ends[1])))
        self._area.set_axis(axis)

    def show_small_range(self) -> None:
        """Show the values around the TF's range if it is a small part of the visible ones."""
        low, high = self._area.axis.places(self._state.scalar_range)
        if high - low < SMALL_RANGE:
            self.show_range()

    def set_range(self, scalar_range: Range) -> None:
        """Set the TF's range: one undo step."""
        # Parts beyond the range come back with a wider one.
        tf = self._state.transfer_function
        whole = self._cut[1] if self._cut is not None and self._cut[0] == tf else tf
        self._state.tf_input.set(fit_to_range(whole, scalar_range), "range")
        self._cut = self._state.transfer_function, whole

    def fit_height(self) -> None:
        """Set the lines' height to the plot's."""
        low, high = self._area.opacity.viewRange()[1]
        height = self._area.opacity.height() * high / (high - low)
        for line in self.lines:
            line.set_height(height)
        for above, _ in self._shades:
            box = above.rect()
            above.setRect(box.left(), 0.0, box.width(), high)

    def recolor(self) -> None:
        """Take the colours of the theme in use."""
        color = QColor(theme.PANEL)
        color.setAlpha(190)
        for shade in (each for pair in self._shades for each in pair):
            shade.setBrush(QBrush(color))

    def _begin(self, adds: bool) -> None:
        self._before, self._cuts = self._state.transfer_function, adds

    def _drag(self, end: int, place: float, _height: float) -> None:
        axis, (lo, hi) = self._area.axis, self._before.scalar_range
        other = axis.place((hi, lo)[end])
        place = min(max(place, 0.0), 1.0)
        at = min(place, other - LEAST_DISTANCE) if end == 0 else max(place, other + LEAST_DISTANCE)
        value = axis.value(at)
        scalar_range = (value, hi) if end == 0 else (lo, value)
        if scalar_range[0] >= scalar_range[1]:
            return
        # From the TF before the drag: what the mouse cuts off comes back when it returns.
        scale = self._state.scale
        if self._cuts:
            cut = cut_to(self._before.opacity, scalar_range)
            self._state.tf_input.move(replace(self._before, opacity=cut))
            text = f"cut {('below', 'above')[end]} {value_text(value, (lo, hi), scale)}"
        else:
            self._state.tf_input.move(stretch_to_range(self._before, scalar_range))
            text = f"range {range_text(scalar_range, scalar_range, scale)}   Ctrl: cut"
        self._area.show_readout(self._area.opacity, value, 0.8, text)

    def _finish(self) -> None:
        self._area.hide_readout()
        self._state.tf_input.finish("cut" if self._cuts else "range")


def _add_shade(view: Any) -> QGraphicsRectItem:
    shade = QGraphicsRectItem(0.0, 0.0, 0.0, 1.0)
    shade.setPen(QPen(Qt.PenStyle.NoPen))
    shade.setZValue(60)
    shade.setAcceptedMouseButtons(Qt.MouseButton.NoButton)
    view.addItem(shade, ignoreBounds=True)
    return shade
