"""The two plots of the editor, stacked over a common scalar axis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QPoint, QPointF, Qt, Signal
from PySide6.QtWidgets import QGraphicsItem, QLabel

from app import theme
from app.tf_editor.histogram import HistogramLayer
from app.tf_editor.opacity_scale import OpacityScale
from app.tf_editor.unit_axis import ScalarAxis
from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale

STRIP_HEIGHT = 44
AXIS_WIDTH = 52
_READOUT_GAP = 18
MOST_TICKS = 5
TICK_ROOM = 9
"""Pixels from an axis' ends in which there are no ticks: their labels would be cut."""

_SIDE_ROOM = 0.025
"""Margin at either end of the axis, as a fraction of it, for handles and grips at the ends."""


class _InnerAxis(pg.AxisItem):  # type: ignore[misc]
    """An axis without ticks so near its ends that their labels would be cut."""

    def tickValues(
        self, minVal: float, maxVal: float, size: float
    ) -> list[tuple[float, list[float]]]:
        """Return pyqtgraph's ticks between the ends: finer ones where only one would be left."""
        room = TICK_ROOM / max(size, 1.0) * (maxVal - minVal)
        levels = [
            (spacing, [v for v in values if minVal + room <= v <= maxVal - room])
            for spacing, values in super().tickValues(minVal, maxVal, size)
        ]
        while len(levels) > 1 and len(levels[0][1]) < 2:
            spacing, values = levels[1]
            values = sorted([*levels[0][1], *values])
            if len(values) > MOST_TICKS:
                values = [v for v in values if round(v / spacing) % 2 == 0]
            levels[:2] = [(spacing, values)]
        return levels


class PlotArea(QObject):
    """Builds the plots and emits the scalar values of clicks beside the handles.

    The plots' horizontal axis is the visible interval of scalar values mapped to 0..1.

    Attributes
    ----------
    axis : ScalarAxis
        Map between scalar values and places in the plots.
    scale : OpacityScale
        Map between opacities and heights in the opacity plot.
    histogram : HistogramLayer
    data_range : tuple of float
        Smallest and largest voxel.
    widget : pyqtgraph.GraphicsLayoutWidget
        The widget with both plots, for a layout.
    opacity, strip : pyqtgraph.ViewBox
        The opacity plot above and the colour strip below.
    """

    opacityClicked = Signal()
    opacityDoubleClicked = Signal(float, float)
    opacityMenuRequested = Signal(float, float, QPoint)
    stripClicked = Signal(float)
    axisChanged = Signal()
    """Emitted when other values are visible, or a scale is another."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.axis = ScalarAxis.over((0.0, 1.0))
        self.data_range: Range = (0.0, 1.0)
        self.scale = OpacityScale()
        self._drawn: dict[Any, tuple[NDArray[np.floating], Range, bool]] = {}
        self.widget: Any = pg.GraphicsLayoutWidget()
        self.widget.setBackground(theme.PANEL)
        self.widget.setProperty("role", "plots")
        self.widget.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.widget.ci.setContentsMargins(0, 0, 8, 4)
        self.widget.ci.layout.setVerticalSpacing(2)
        self.opacity: Any = self._add_view(row=0)
        self.strip: Any = self._add_view(row=1)
        self.strip.setXLink(self.opacity)
        self.opacity.setXRange(-_SIDE_ROOM, 1.0 + _SIDE_ROOM, padding=0)
        self.opacity.setYRange(-0.02, 1.06, padding=0)
        self.strip.setYRange(0, 1, padding=0)
        self.widget.ci.layout.setRowFixedHeight(1, STRIP_HEIGHT)
        self._opacities: Any = self._add_axis("left", self.opacity, row=0, col=0)
        self._opacities.setWidth(AXIS_WIDTH)
        self._opacities.setLabel("Opacity")
        self._opacities.setTicks([self.scale.ticks()])
        self._values: Any = self._add_axis("bottom", self.strip, row=2, col=1)
        # Beside the axis of a second scale, which is at column 2.
        counts = self._add_axis("right", self.opacity, row=0, col=3)
        counts.setToolTip("Number of voxels in each bin of the histogram, on a logarithmic scale")
        self.histogram = HistogramLayer(self.opacity, counts)
        self._readout = QLabel(self.widget)
        self._readout.setProperty("role", "readout")
        self._readout.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._readout.hide()
        self.widget.scene().sigMouseClicked.connect(self._clicked)

    def set_data(
        self,
        counts: NDArray[np.int64],
        edges: NDArray[np.float64],
        data_range: Range,
        units: str,
        scale: ValueScale = "linear",
    ) -> None:
        """Show a volume's histogram and all of its values; see the editor's method."""
        self.data_range = data_range
        self.histogram.set_data(counts, edges)
        title = "Scalar value, logarithmic" if scale == "log" else "Scalar value"
        self._values.setLabel(f"{title} ({units})" if units else title)
        self.set_axis(ScalarAxis.over(data_range, self.axis.scale != "linear", scale))

    def set_axis(self, axis: ScalarAxis) -> None:
        """Show other values, or on another scale."""
        self.axis = axis
        self._values.setTicks([axis.ticks()])
        self.histogram.draw(axis)
        for item in self._drawn:
            self._draw(item)
        self.axisChanged.emit()

    def set_scale(self, scale: OpacityScale) -> None:
        """Spread the opacities over the plot in another way."""
        self.scale = scale
        self._opacities.setTicks([scale.ticks()])
        for item in self._drawn:
            self._draw(item)
        self.axisChanged.emit()

    def include(self, scalar_range: Range, scale: ValueScale) -> None:
        """Let a TF's range be made visible, as well as the volume's values on the same scale."""
        if scale != self.axis.labels:
            return
        lo = min(self.data_range[0], scalar_range[0])
        hi = max(self.data_range[1], scalar_range[1])
        if (lo, hi) != self.axis.full:
            everything = self.axis.visible == self.axis.full
            axis = ScalarAxis.over((lo, hi), self.axis.scale != "linear", self.axis.labels)
            self.set_axis(axis if everything else axis.showing(self.axis.visible))

    def draw(
        self,
        item: Any,
        heights: NDArray[np.floating],
        scalar_range: Range,
        *,
        are_opacities: bool = False,
    ) -> None:
        """Draw heights at even values over a range in a curve, now and on every other axis.

        Parameters
        ----------
        item : pyqtgraph.PlotCurveItem
            In the opacity plot or in one of a second scale.
        heights : ndarray, shape (n,)
        scalar_range : tuple of float
            The values of the first and the last of them.
        are_opacities : bool
            Whether the opacity plot's scale applies to the heights.
        """
        self._drawn[item] = heights, scalar_range, are_opacities
        self._draw(item)

    def _draw(self, item: Any) -> None:
        heights, scalar_range, are_opacities = self._drawn[item]
        places = self.axis.places(np.linspace(*scalar_range, len(heights)))
        inside = (places >= 0) & (places <= 1)
        if not inside.all():
            # The curve is cut at the ends of what is visible, as the plots do not clip.
            ends = [end for end in (0.0, 1.0) if places[0] < end < places[-1]]
            cut = np.union1d(places[inside], ends)
            places, heights = cut, np.interp(cut, places, heights)
        item.setData(places, self.scale.heights(heights) if are_opacities else heights)

    @property
    def readout(self) -> str:
        """Numbers shown beside the mouse during a drag; empty otherwise."""
        return "" if self._readout.isHidden() else self._readout.text()

    def show_readout(self, plot: Any, value: float, height: float, text: str) -> None:
        """Show numbers beside a point of one of the plots."""
        place = self.axis.place(value)
        at = self.widget.mapFromScene(plot.mapViewToScene(QPointF(place, height)))
        self._readout.setText(text)
        self._readout.adjustSize()
        size = self._readout.size()
        on_right = at.x() < self.widget.width() / 2
        x = at.x() + _READOUT_GAP if on_right else at.x() - _READOUT_GAP - size.width()
        y = min(max(at.y() - size.height() // 2, 0), self.widget.height() - size.height())
        self._readout.move(x, y)
        self._readout.show()

    def hide_readout(self) -> None:
        """Hide the numbers again."""
        self._readout.hide()

    def add_second_scale(self) -> tuple[Any, Any]:
        """Add a plot behind the opacity's, with an axis of its own at the right.

        Returns
        -------
        view : pyqtgraph.ViewBox
        axis : pyqtgraph.AxisItem
        """
        view = pg.ViewBox(enableMouse=False, enableMenu=False, defaultPadding=0)
        view.disableAutoRange()
        view.setAcceptedMouseButtons(Qt.MouseButton.NoButton)
        self.widget.scene().addItem(view)
        view.setZValue(self.opacity.zValue() - 1)
        view.setXLink(self.opacity)
        self.opacity.sigResized.connect(
            lambda *_: view.setGeometry(self.opacity.sceneBoundingRect())
        )
        axis = _InnerAxis("right", linkView=view, pen=theme.BORDER, textPen=theme.DIM_TEXT)
        self._place_axis(axis, row=0, col=2)
        return view, axis

    def _add_view(self, row: int) -> Any:
        """Add a plot without panning, zooming and context menu."""
        view = pg.ViewBox(enableMouse=False, enableMenu=False, defaultPadding=0)
        view.disableAutoRange()
        # Qt would clip handles of constant size in the wrong units, making them hard to hit.
        view.setFlag(QGraphicsItem.GraphicsItemFlag.ItemClipsChildrenToShape, False)
        self.widget.addItem(view, row=row, col=1)
        return view

    def _add_axis(self, side: str, view: Any, row: int, col: int) -> Any:
        axis = pg.AxisItem(side, linkView=view, pen=theme.BORDER, textPen=theme.DIM_TEXT)
        self._place_axis(axis, row, col)
        return axis

    def _place_axis(self, axis: Any, row: int, col: int) -> None:
        axis.setStyle(tickLength=-4)
        axis.enableAutoSIPrefix(False)
        self.widget.addItem(axis, row=row, col=col)

    def _clicked(self, event: Any) -> None:
        """Emit the signal for a click on one of the plots; handles accept their own clicks."""
        position: QPointF = event.scenePos()
        left = event.button() == Qt.MouseButton.LeftButton
        if self.opacity.sceneBoundingRect().contains(position):
            at = self.opacity.mapSceneToView(position)
            value = self.axis.value(at.x())
            if event.button() == Qt.MouseButton.RightButton:
                screen = event.screenPos()
                point = QPoint(int(screen.x()), int(screen.y()))
                self.opacityMenuRequested.emit(value, self.scale.opacity(at.y()), point)
            elif left and event.double():
                self.opacityDoubleClicked.emit(value, self.scale.opacity(at.y()))
            elif left:
                self.opacityClicked.emit()
        elif self.strip.sceneBoundingRect().contains(position) and left:
            place = self.strip.mapSceneToView(position).x()
            self.stripClicked.emit(self.axis.value(place))
