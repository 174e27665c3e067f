"""The two plots of the editor, stacked over a common scalar axis."""

from collections.abc import Callable
from typing import Any, Literal, cast

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, QRectF, QSizeF, Qt, Signal
from PySide6.QtGui import QBrush, QColor, QFocusEvent, QFont, QFontMetricsF, QHelpEvent, QPainter
from PySide6.QtWidgets import (
    QApplication,
    QGraphicsItem,
    QGraphicsWidget,
    QLabel,
    QMenu,
    QStyleOptionGraphicsItem,
    QToolTip,
    QWidget,
)

from app import theme
from app.controls import BY_KEYS, QT_SHIFT, add_action
from app.state.opened_volume import OpenedVolume
from app.tf_editor.handles import DragHandle
from app.tf_editor.histogram import Curve, HistogramLayer
from app.tf_editor.unit_axis import OpacityScale, ScalarAxis
from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale

LEFT_MARGIN, RIGHT_MARGIN, TOP_MARGIN = 36, 54, 8
"""Room next to the plots for their numbers, and above them, in pixels."""

STRIP_HEIGHT, PINS_HEIGHT, LABELS_HEIGHT = 14, 14, 20
"""Heights of the colours, of their pins below, and of the numbers, in pixels."""

PIN_PLACE = -0.5 * PINS_HEIGHT / STRIP_HEIGHT  # height above the strip, in its heights
ZOOM_STEP = 1.25  # by which a step of the wheel scales the visible interval
GAP = 18  # pixels between a point and the numbers of its drag
HEADROOM = 16  # pixels above the opacity 1, for flags and the grips of the range
Side = Literal["left", "bottom", "right"]

LABEL_PIXELS = 11  # height of the numbers' font
LABEL_GAP = 7  # pixels between a number and the plot at its side
APART = 14  # least distance of two numbers from one another, in pixels
NEAR_GAP = 8  # pixels between the plot and a number at its right, where room is short
OVERHANG = 44  # pixels by which numbers at the ends may reach beyond the plot

# Nothing here uses its hover events, which cost as much as a drag.
pg.setConfigOption("mouseRateLimit", 5)


class PlotArea(QObject):
    """The plots, their axes and what is drawn in them by values and heights.

    The plots' horizontal axis is the visible interval of scalar values mapped to 0..1. The view
    boxes are the opacity plot, the colour strip below it, a second quantity behind the opacities,
    and, behind both, areas on the scale of the opacities.
    """

    axisChanged = Signal()  # when the visible values or a scale change
    heightChanged = Signal()  # when the opacity plot is resized
    flagsMoved = Signal()  # emitted when widgets over the plot move, or a drag's numbers
    recolored = Signal()  # when the theme changes

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.axis = ScalarAxis.over((0.0, 1.0))  # scalar values and positions in the plots
        self.scale = OpacityScale()  # opacities and heights in the opacity plot
        self.data_range: Range = (0.0, 1.0)
        self._drawn: dict[Curve, tuple[NDArray[np.floating], Range, bool]] = {}
        self._units = ""
        self.widget: Any = pg.GraphicsLayoutWidget()
        self.widget.setProperty("role", "plots")
        self.widget.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.widget.setAccessibleName("Transfer function")
        self.widget.setMinimumSize(200, 60)
        layout = self.widget.ci.layout
        self.widget.ci.setContentsMargins(0, TOP_MARGIN, 0, 0)
        layout.setSpacing(0)
        self.opacity: Any = _add_view(self.widget, row=0)
        self.strip: Any = _add_view(self.widget, row=1)
        self.strip.setXLink(self.opacity)
        self.opacity.setXRange(0.0, 1.0, padding=0)
        self.strip.setYRange(0, 1, padding=0)
        for row, height in enumerate((STRIP_HEIGHT, PINS_HEIGHT, LABELS_HEIGHT), start=1):
            layout.setRowFixedHeight(row, height)
        for column, width in ((0, LEFT_MARGIN), (2, RIGHT_MARGIN)):
            layout.setColumnFixedWidth(column, width)
        self._opacities = _add_labels(self.widget, "left", 0, 0, "Opacity")
        self.second_labels = _add_labels(self.widget, "right", 0, 2, "")
        self._values = _add_labels(self.widget, "bottom", 3, 1, "Scalar value")
        self.second, self.back = _view_behind(self.opacity, 1), _view_behind(self.opacity, 2)
        self._lines: list[Any] = []
        self.histogram = HistogramLayer(self.back)
        self._readout = QLabel(self.widget)
        self._readout.setProperty("role", "readout")
        self._readout.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._readout.hide()
        self.flags: list[QWidget] = []  # widgets over the plot that nothing else may cover
        self.opacity.sigResized.connect(lambda *_: self._fit_heights())
        for watched in (self.widget, self.widget.viewport()):
            watched.installEventFilter(self)
        self._recolor()

    @property
    def headroom(self) -> float:
        """Height above the opacity 1, in that of the opacities."""
        return HEADROOM / max(float(self.opacity.height()) - HEADROOM, 1.0)

    @property
    def rect(self) -> QRect:
        """The opacity plot in pixels of the widget."""
        box = self.opacity.sceneBoundingRect()
        return QRect(*map(self.widget.mapFromScene, (box.topLeft(), box.bottomRight())))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the colours of another theme, and set the tooltip with the voxels of a bar."""
        kind = event.type()
        if kind == QEvent.Type.PaletteChange and watched is self.widget:
            self._recolor()
        elif isinstance(event, QFocusEvent) and watched is self.widget:
            self._show_ring(event.gotFocus() and event.reason() in BY_KEYS)
        elif kind == QEvent.Type.ToolTip and watched is self.widget.viewport():
            where = cast(QHelpEvent, event)
            said = self._text_at(where.pos())
            if said:
                # Below the plot, so as not to hide its place in it, and above the keys' hints.
                below = QPoint(where.pos().x(), self.rect.bottom()) - QT_SHIFT
                QToolTip.showText(self.widget.viewport().mapToGlobal(below), said, self.widget)
                return True
        return False

    def _show_ring(self, ringed: bool) -> None:
        """Show a ring where keys have brought the focus, none where the mouse has."""
        self.widget.setProperty("ringed", ringed)
        self.widget.style().unpolish(self.widget)
        self.widget.style().polish(self.widget)

    def _text_at(self, point: QPoint) -> str:
        """Text about the histogram's bar at a pixel; empty over a handle."""
        if self.has_handle_at(point) or not (
            self.rect.contains(point) and self.histogram.curve.isVisible()
        ):
            return ""
        place = float(self.opacity.mapSceneToView(self.widget.mapToScene(point)).x())
        return self.histogram.text_at(self.axis.value(place), self.axis.labels)

    def pixel(self, plot: Any, place: float, height: float) -> QPoint:
        """Return where a point of one of the plots is, in pixels of the widget."""
        at = self.widget.mapFromScene(plot.mapViewToScene(QPointF(place, height)))
        return QPoint(at.x(), at.y())

    def has_handle_at(self, point: QPoint) -> bool:
        """Return whether a handle in sight takes the mouse at a pixel of the widget."""
        items = self.widget.items(point)
        return any(isinstance(item, DragHandle) and item.isVisible() for item in items)

    def handle_boxes(self) -> list[QRect]:
        """Return where the handles in sight are, in pixels of the widget."""
        boxes = []
        for item in self.opacity.childGroup.childItems():
            if type(item) is DragHandle and item.isVisible():
                center = self.widget.mapFromScene(item.scenePos())
                boxes.append(QRect(center.x() - 7, center.y() - 7, 14, 14))
        return boxes

    def label_boxes(self) -> list[QRect]:
        """Return where labels in sight are over the opacity plot, in pixels of the widget."""
        items = self.opacity.childGroup.childItems()
        labels = [item for item in items if isinstance(item, pg.TextItem) and item.isVisible()]
        return [
            self.widget.mapFromScene(label.sceneBoundingRect()).boundingRect() for label in labels
        ]

    def peak_boxes(self) -> list[QRect]:
        """Return where drawn curves in sight have half of their height, in pixels of the widget."""
        boxes = []
        for curve in self._drawn:
            heights = abs(curve.heights) if curve.isVisible() else np.empty(0)
            for index in np.flatnonzero(2 * heights > np.max(heights, initial=0.0)):
                at = curve.mapToScene(QPointF(curve.places[index], curve.heights[index]))
                at = self.widget.mapFromScene(at)
                boxes.append(QRect(at.x() - 2, at.y() - 2, 4, 4))
        return boxes

    def card_boxes(self) -> list[QRect]:
        """Return where flags and cards in sight are, in pixels of the widget."""
        direct = Qt.FindChildOption.FindDirectChildrenOnly
        cards = self.widget.viewport().findChildren(QWidget, options=direct)
        return [card.geometry() for card in cards if card.isVisible()]

    def add_flag(self, flag: QWidget) -> None:
        """Put a widget over the plot that nothing else may cover."""
        flag.setParent(self.widget.viewport())
        self.flags.append(flag)

    def _recolor(self) -> None:
        self.widget.setBackground(theme.PANEL)
        self.back.setBackgroundColor(theme.PLOT)
        self.histogram.curve.brush = QBrush(QColor(theme.VOXELS))
        self._label_opacities()
        self._label_values()
        self.recolored.emit()
        # Handles are painted from a cache.
        for item in self.widget.scene().items():
            item.update()

    def _fit_heights(self) -> None:
        """Fit the opacities between the strip and the headroom, and the rest with them."""
        for view in (self.opacity, self.back):
            view.setYRange(0.0, 1.0 + self.headroom, padding=0)
        for view in (self.second, self.back):
            view.setGeometry(self.opacity.sceneBoundingRect())
        self._label_opacities()
        self.heightChanged.emit()

    def _label_opacities(self) -> None:
        whole = 1.0 + self.headroom
        ticks = self.scale.ticks()
        self._opacities.set_labels([(at / whole, text) for at, text in ticks], theme.DIM)
        while self._lines:
            self.back.removeItem(self._lines.pop())
        for at, text in ticks:
            style = Qt.PenStyle.DotLine if text == ".5" else Qt.PenStyle.SolidLine
            line = pg.InfiniteLine(at, angle=0, pen=pg.mkPen(theme.LINE, width=1, style=style))
            line.setZValue(-20)
            self.back.addItem(line, ignoreBounds=True)
            self._lines.append(line)

    def _label_values(self) -> None:
        self._values.set_labels(self.axis.marks(self._units), theme.DIM)

    def set_data(self, opened: OpenedVolume) -> None:
        """Show a volume's histogram and all of its values."""
        volume, units = opened.volume, opened.volume.units
        self.data_range, self._units = volume.data_range, units
        self.histogram.set_data(opened.counts, opened.edges)
        title = "Scalar value, logarithmic" if volume.scale == "log" else "Scalar value"
        self._values.setToolTip(f"{title} ({units})" if units else title)
        labels = volume.scale, volume.file.label_numbers
        self.set_axis(ScalarAxis.over(volume.data_range, self.axis.scale != "linear", *labels))

    def set_axis(self, axis: ScalarAxis) -> None:
        """Show other values, or on another scale."""
        self.axis = axis
        self._label_values()
        self.histogram.draw(axis)
        for item in self._drawn:
            self._draw(item)
        self.axisChanged.emit()

    def set_scale(self, scale: OpacityScale) -> None:
        """Set the scale of the opacities."""
        self.scale = scale
        self._label_opacities()
        for item in self._drawn:
            self._draw(item)
        self.axisChanged.emit()

    def include(self, scalar_range: Range, scale: ValueScale) -> None:
        """Let the axis show a TF's range, too, beyond the volume's values on the same scale."""
        if scale != self.axis.labels:
            return
        lo = min(self.data_range[0], scalar_range[0])
        hi = max(self.data_range[1], scalar_range[1])
        if (lo, hi) != self.axis.full:
            everything = self.axis.visible == self.axis.full
            axis = self.axis
            axis = ScalarAxis.over((lo, hi), axis.scale != "linear", axis.labels, axis.numbers)
            self.set_axis(axis if everything else axis.showing(self.axis.visible))

    def draw(
        self,
        item: Curve,
        heights: NDArray[np.floating],
        scalar_range: Range,
        *,
        are_opacities: bool = False,
    ) -> None:
        """Draw heights (n,) at even values over a range by a curve, on every axis."""
        self._drawn[item] = heights, scalar_range, are_opacities
        self._draw(item)

    def _draw(self, item: Curve) -> None:
        heights, scalar_range, are_opacities = self._drawn[item]
        places = self.axis.places(np.linspace(*scalar_range, len(heights)))
        inside = (places >= 0) & (places <= 1)
        if not inside.all():
            # The curve is cut at the ends of what is visible, as the plots do not clip.
            ends = [end for end in (0.0, 1.0) if places[0] < end < places[-1]]
            cut = np.union1d(places[inside], ends)
            places, heights = cut, np.interp(cut, places, heights)
        item.draw(places, self.scale.heights(heights) if are_opacities else heights)

    def zoom(self, steps: float, place: float = 0.5) -> None:
        """Zoom in by a number of steps, or out by a negative one, around a point of the plots."""
        self.set_axis(self.axis.zoomed(ZOOM_STEP**steps, min(max(place, 0.0), 1.0)))

    def show_all(self) -> None:
        """Show all values of the volume and of the TF's range."""
        self.set_axis(self.axis.showing(self.axis.full))

    @property
    def readout(self) -> str:
        """The numbers of a drag; empty where none are shown."""
        return "" if self._readout.isHidden() else self._readout.text()

    def show_readout(self, plot: Any, value: float, height: float, text: str) -> None:
        """Show numbers next to a point of one of the plots, on the side where there is room."""
        label, whole = self._readout, self.widget.size()
        at = self.pixel(plot, self.axis.place(value), height)
        label.setText(text)
        label.adjustSize()
        x = at.x() + GAP if at.x() < whole.width() / 2 else at.x() - GAP - label.width()
        y = min(max(at.y() - label.height() // 2, 0), whole.height() - label.height())
        label.move(x, y)
        if label.isHidden():
            label.show()
            self.flagsMoved.emit()

    def hide_readout(self) -> None:
        """Hide the numbers of a drag."""
        if not self._readout.isHidden():
            self._readout.hide()
            self.flagsMoved.emit()

    def pop_up(self, point: QPoint, *entries: tuple[str, Callable[[], object], bool]) -> None:
        """Open a menu at a point of the screen: texts, actions, and whether each is enabled."""
        menu = QMenu(self.widget)
        for text, call, enabled in entries:
            add_action(menu, text, call).setEnabled(enabled)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(point)


def label_font() -> QFont:
    """Return the font of the numbers in and next to the plots."""
    font = QFont(QApplication.font())
    font.setPixelSize(LABEL_PIXELS)
    return font


class PlotLabels(QGraphicsWidget):
    """Numbers along one side of a plot, each at its position."""

    def __init__(self, side: Side) -> None:
        super().__init__()
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)
        self._side = side
        self._color = QColor()
        self.labels: tuple[tuple[float, str], ...] = ()
        """Positions along the side, from 0 at the left or bottom to 1, and numbers."""

    def set_labels(self, labels: list[tuple[float, str]], color: str) -> None:
        """Set the numbers and their colour."""
        self.labels, self._color = tuple(labels), QColor(color)
        self.update()

    def boundingRect(self) -> QRectF:
        """Return the area of all numbers, in pixels."""
        return QRectF(QPointF(), QSizeF(self.size())).adjusted(-OVERHANG, -8, OVERHANG, 8)

    def boxes(self) -> list[tuple[QRectF, str]]:
        """Return where the numbers are, in the item's pixels, without those that would overlap."""
        metrics = QFontMetricsF(label_font())
        found: list[tuple[QRectF, str]] = []
        # Those at the ends first: they give the visible interval.
        ends = self.labels[:1] + self.labels[-1:]
        for place, text in (*ends, *self.labels[1:-1]):
            box = self._box(place, metrics.horizontalAdvance(text), metrics.height())
            if not any(box.adjusted(-APART, 0, APART, 0).intersects(other) for other, _ in found):
                found.append((box, text))
        return found

    def paint(
        self, painter: QPainter, _option: QStyleOptionGraphicsItem, _widget: QWidget | None = None
    ) -> None:
        """Paint the numbers."""
        painter.setFont(label_font())
        painter.setPen(self._color)
        for box, text in self.boxes():
            painter.drawText(box.adjusted(-2, 0, 2, 0), Qt.AlignmentFlag.AlignCenter, text)

    def _box(self, place: float, width: float, height: float) -> QRectF:
        size = self.size()
        if self._side == "bottom":
            # The unit makes the last one long: it ends at the window's edge.
            farthest = size.width() + OVERHANG - LABEL_GAP - width
            return QRectF(min(place * size.width() - width / 2, farthest), 2, width, height)
        y = (1.0 - place) * size.height() - height / 2
        left = size.width() - LABEL_GAP - width if self._side == "left" else NEAR_GAP
        return QRectF(left, y, width, height)


def _view_behind(opacity: Any, steps: int) -> Any:
    """Return a plot of the opacity plot's position and size, behind it."""
    view = pg.ViewBox(enableMouse=False, enableMenu=False, defaultPadding=0)
    view.disableAutoRange()
    view.setAcceptedMouseButtons(Qt.MouseButton.NoButton)
    opacity.scene().addItem(view)
    view.setZValue(opacity.zValue() - steps)
    view.setXLink(opacity)
    return view


def _add_view(widget: Any, row: int) -> Any:
    """Add a plot without panning, zooming and context menu."""
    view = pg.ViewBox(enableMouse=False, enableMenu=False, defaultPadding=0)
    view.disableAutoRange()
    # Qt would clip handles of constant size in the wrong units, making them hard to hit.
    view.setFlag(QGraphicsItem.GraphicsItemFlag.ItemClipsChildrenToShape, False)
    widget.addItem(view, row=row, col=1)
    return view


def _add_labels(widget: Any, side: Side, row: int, column: int, tip: str) -> PlotLabels:
    labels = PlotLabels(side)
    labels.setToolTip(tip)
    labels.setZValue(-101)  # so that the lines at both ends of the plot have their tips
    widget.ci.addItem(labels, row=row, col=column)
    return labels
