"""The picture and the TF of what the mouse is over, in the reference's pane and the TF editor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app import theme
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import to_qimage
from app.latent_browser.map_facts import SOURCES
from app.state.engine_chooser import EngineName
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
        """The picture's caption; empty without one."""
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

    def show_picture(
        self,
        image: NDArray[np.float32] | None,
        caption: str = "",
        engine: EngineName = "exact",
    ) -> None:
        """Show an engine's picture (S, S, 4) instead of the reference's; None for the latter."""
        if image is None and not self._covers:
            return
        self._covers = image is not None
        self._caption = caption if self._covers else ""
        brightness = self._pane.brightness.of(engine)
        self._pane.canvas.show_cover(None if image is None else to_qimage(image, brightness))
        self._show_caption()

    def show_hover(self, picture: HoverPicture | None) -> None:
        """Show the picture of the place under the mouse; None for none."""
        if picture is None:
            self.show_picture(None)
            return
        source = SOURCES[picture.source]
        drawn = f"{source} from the code" if picture.of_code else source
        of = {0: "nearest sample, none in the disc", 1: "one sample"}.get(
            picture.samples, f"{picture.samples} samples"
        )
        text = f"Under the mouse: {of}; {drawn}, {1000 * picture.seconds:.0f} ms"
        self.show_picture(picture.image, text, picture.source)

    def _show_caption(self) -> None:
        if self._covers:
            title, _, rest = self._caption.partition(": ")
            self._pane.name_cover(title, "click to take", f"{rest}\n{self._facts}".strip())
        else:
            self._pane.name_cover("")
