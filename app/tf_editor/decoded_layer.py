"""The decoded TF as a dotted curve over the opacity TF, with how far it is from it."""

from __future__ import annotations

from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QObject, Qt

from app.state.decoded_tf import DecodedTF
from app.tf_editor.plot_area import PlotArea

COLOR = "#cc79a7"


class DecodedLayer(QObject):
    """Draws what the model's codec makes of the opacity TF."""

    def __init__(self, area: PlotArea, decoded: DecodedTF) -> None:
        super().__init__(area)
        self._area = area
        self._decoded = decoded
        pen = pg.mkPen(COLOR, width=2, style=Qt.PenStyle.DotLine)
        self.curve: Any = pg.PlotCurveItem(pen=pen, antialias=True)
        self.curve.setZValue(75)
        self.text: Any = pg.TextItem(color=COLOR, anchor=(1, 0))
        # Below the flags of the sensitivity.
        self.text.setPos(0.99, 0.92)
        for item in (self.curve, self.text):
            item.hide()
            area.opacity.addItem(item, ignoreBounds=True)
        decoded.changed.connect(self._show)

    def _show(self) -> None:
        opacities = self._decoded.opacities
        for item in (self.curve, self.text):
            item.setVisible(opacities is not None)
        if opacities is not None:
            self._area.draw(self.curve, opacities, self._decoded.scalar_range, are_opacities=True)
            self.text.setText(f"decoded TF, differs by {self._decoded.difference:.3f}")
