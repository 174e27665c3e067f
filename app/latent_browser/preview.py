"""The picture and the TF of what the mouse is over, in the reference's pane and the TF editor."""

from __future__ import annotations

from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QObject, Signal

from app import theme
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import to_qimage
from app.state.latent_pictures import HoverPicture
from app.tf_editor.plot_area import PlotArea
from model.scene.transfer_function import OpacityTF


class Preview(QObject):
    """Covers the reference by another TF's picture, and draws that TF over the editor's."""

    tfChanged = Signal(object)
    """Emitted with the opacity TF of what is shown instead of the image, or None for none."""

    def __init__(self, pane: EnginePane, area: PlotArea) -> None:
        super().__init__(pane)
        self._pane = pane
        self._area = area
        self._covers = False
        self._curve: Any = pg.PlotCurveItem(
            pen=pg.mkPen(theme.WARNING, width=1.6, dash=[5, 3]), antialias=True
        )
        self._curve.setZValue(80)
        self._curve.hide()
        area.opacity.addItem(self._curve, ignoreBounds=True)

    @property
    def is_shown(self) -> bool:
        """Whether a picture covers the reference's."""
        return self._covers

    def show_tf(self, tf: OpacityTF | None) -> None:
        """Draw a TF over the editor's own; None for none."""
        if tf is not None:
            self._area.draw(self._curve, tf.sample(), tf.scalar_range, are_opacities=True)
        self._curve.setVisible(tf is not None)
        self.tfChanged.emit(tf)

    def show_hover(self, picture: HoverPicture | None) -> None:
        """Show the picture of the place under the mouse instead of the reference's, or not."""
        if picture is None and not self._covers:
            return
        self._covers = picture is not None
        if picture is None:
            self._pane.canvas.show_cover(None)
            self._pane.name_cover("")
            return
        brightness = self._pane.brightness.of(picture.source)
        self._pane.canvas.show_cover(to_qimage(picture.image, brightness))
        of = {0: "The nearest TF of the map", 1: "A TF of the map"}
        explained = of.get(picture.samples, f"The mean of {picture.samples} TFs of the map")
        self._pane.name_cover("Under the mouse", "click to take", explained)
