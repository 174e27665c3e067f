"""The picture and the TF of what the mouse is over, in the reference's pane and the TF editor."""

from __future__ import annotations

from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QObject, Signal

from app import theme
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import to_qimage
from app.latent_browser.map_facts import SOURCES
from app.state.latent_pictures import HoverPicture
from app.tf_editor.plot_area import PlotArea
from model.scene.transfer_function import OpacityTF


class Preview(QObject):
    """Covers the reference by another TF's picture, and draws that TF over the editor's.

    Parameters
    ----------
    pane : EnginePane
        The reference's.
    area : PlotArea
        The TF editor's plots.
    """

    tfChanged = Signal(object)
    """Emitted with the opacity TF of what is shown instead of the image, or None for none."""

    def __init__(self, pane: EnginePane, area: PlotArea) -> None:
        super().__init__(pane)
        self._pane = pane
        self._area = area
        self._caption = self._facts = ""
        self._covers = False
        self._curve: Any = pg.PlotCurveItem(
            pen=pg.mkPen(theme.WARNING, width=1.6, dash=[5, 3]), antialias=True
        )
        self._curve.setZValue(80)
        self._curve.hide()
        area.opacity.addItem(self._curve, ignoreBounds=True)

    @property
    def caption(self) -> str:
        """How the picture came about; empty without one."""
        return self._caption

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

    def set_facts(self, facts: str) -> None:
        """Set what there is to know of the map and its pictures, for the caption's tooltip."""
        self._facts = facts
        self._show_caption()

    def show_hover(self, picture: HoverPicture | None) -> None:
        """Show the picture of the place under the mouse instead of the reference's, or not."""
        if picture is None and not self._covers:
            return
        self._covers = picture is not None
        cover = None
        self._caption = ""
        if picture is not None:
            source = SOURCES[picture.source]
            drawn = f"{source} from the code" if picture.of_code else source
            of = {0: "nearest sample, none in the disc", 1: "one sample"}.get(
                picture.samples, f"{picture.samples} samples"
            )
            self._caption = f"{of}; {drawn}, {1000 * picture.seconds:.0f} ms"
            cover = to_qimage(picture.image, self._pane.brightness.of(picture.source))
        self._pane.canvas.show_cover(cover)
        self._show_caption()

    def _show_caption(self) -> None:
        if self._covers:
            explained = f"{self._caption}\n{self._facts}".strip()
            self._pane.name_cover("Under the mouse", "click to take", explained)
        else:
            self._pane.name_cover("")
