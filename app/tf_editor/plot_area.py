"""The two plots of the editor, stacked over a common scalar axis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QPoint, QPointF, Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QGraphicsItem, QLabel

from app import theme
from app.tf_editor.unit_axis import from_unit, ticks, to_unit
from model.scene.transfer_function import Range

STRIP_HEIGHT = 44
AXIS_WIDTH = 44
_READOUT_GAP = 18
_SIDE_ROOM = 0.015
"""Margin at either end of the axis, as a fraction of it, for the handles at the ends."""


class PlotArea(QObject):
    """Builds the plots and emits the scalar values of clicks beside the handles.

    The plots' horizontal axis is the scalar range mapped to 0..1.

    Attributes
    ----------
    widget : pyqtgraph.GraphicsLayoutWidget
        The widget with both plots, for a layout.
    opacity, strip : pyqtgraph.ViewBox
        The opacity plot above and the colour strip below.
    """

    opacityClicked = Signal()
    opacityDoubleClicked = Signal(float, float)
    opacityMenuRequested = Signal(float, float, QPoint)
    stripClicked = Signal(float)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._scalar_range: Range = (0.0, 1.0)
        self.widget: Any = pg.GraphicsLayoutWidget()
        self.widget.setBackground(theme.PANEL)
        self.widget.ci.setContentsMargins(0, 0, 8, 4)
        self.widget.ci.layout.setVerticalSpacing(2)
        self.opacity: Any = self._add_view(row=0)
        self.strip: Any = self._add_view(row=1)
        self.strip.setXLink(self.opacity)
        self.opacity.setXRange(-_SIDE_ROOM, 1.0 + _SIDE_ROOM, padding=0)
        self.opacity.setYRange(-0.02, 1.06, padding=0)
        self.strip.setYRange(0, 1, padding=0)
        self.widget.ci.layout.setRowFixedHeight(1, STRIP_HEIGHT)
        heights = self._add_axis("left", self.opacity, row=0, col=0)
        heights.setWidth(AXIS_WIDTH)
        heights.setLabel("Opacity")
        heights.setTicks([[(0, "0"), (0.25, ""), (0.5, "0.5"), (0.75, ""), (1, "1")]])
        self._values: Any = self._add_axis("bottom", self.strip, row=2, col=1)
        histogram_color = QColor(theme.DIM_TEXT)
        histogram_color.setAlpha(46)
        self._histogram: Any = pg.PlotCurveItem(fillLevel=0, pen=None, brush=histogram_color)
        self.opacity.addItem(self._histogram, ignoreBounds=True)
        self._readout = QLabel(self.widget)
        self._readout.setProperty("role", "readout")
        self._readout.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._readout.hide()
        self.widget.scene().sigMouseClicked.connect(self._clicked)

    def set_data(
        self,
        counts: NDArray[np.int64],
        scalar_range: Range,
        units: str,
    ) -> None:
        """Show a volume's histogram, logarithmic in the counts, over its scalar range."""
        self._scalar_range = scalar_range
        heights = np.log1p(counts)
        places = np.linspace(0.0, 1.0, len(counts) + 1)
        self._histogram.setData(places, heights / max(heights.max(), 1.0), stepMode="center")
        self._values.setTicks([ticks(scalar_range)])
        self._values.setLabel(f"Scalar value ({units})" if units else "Scalar value")

    @property
    def readout(self) -> str:
        """Numbers shown beside the mouse during a drag; empty otherwise."""
        return "" if self._readout.isHidden() else self._readout.text()

    def show_readout(self, plot: Any, value: float, height: float, text: str) -> None:
        """Show numbers beside a point of one of the plots."""
        place = to_unit(value, self._scalar_range)
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

    @property
    def scalar_range(self) -> Range:
        """The scalar range of the axis."""
        return self._scalar_range

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
        axis = self._add_axis("right", view, row=0, col=2)
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
        axis.setStyle(tickLength=-4)
        axis.enableAutoSIPrefix(False)
        self.widget.addItem(axis, row=row, col=col)
        return axis

    def _clicked(self, event: Any) -> None:
        """Emit the signal for a click on one of the plots; handles accept their own clicks."""
        position: QPointF = event.scenePos()
        left = event.button() == Qt.MouseButton.LeftButton
        if self.opacity.sceneBoundingRect().contains(position):
            at = self.opacity.mapSceneToView(position)
            value = from_unit(at.x(), self._scalar_range)
            if event.button() == Qt.MouseButton.RightButton:
                screen = event.screenPos()
                point = QPoint(int(screen.x()), int(screen.y()))
                self.opacityMenuRequested.emit(value, at.y(), point)
            elif left and event.double():
                self.opacityDoubleClicked.emit(value, at.y())
            elif left:
                self.opacityClicked.emit()
        elif self.strip.sceneBoundingRect().contains(position) and left:
            place = self.strip.mapSceneToView(position).x()
            self.stripClicked.emit(from_unit(place, self._scalar_range))
