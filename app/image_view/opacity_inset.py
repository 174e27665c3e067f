"""A pane's opacity image, small in the lower left corner of its colour image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen

from app import theme
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import to_qimage

SHARE, MARGIN = 0.3, 12
"""Edge of the inset as a fraction of the image's, and its distance from the image's edges."""

SCALE_BAR = 1 / 12, 36
"""Height that a scale bar has below the inset: as a fraction of the image's shorter side, and at
least in pixels."""

TITLE = "Opacity image"


class OpacityInset(QObject):
    """Paints how opaque each pixel is: white is opaque, black transparent.

    A generator draws this image first, and its colours from it; a renderer computes it with the
    colours. While something covers the pane's image, such as a field of sensitivities, it is
    left out.
    """

    def __init__(self, pane: EnginePane) -> None:
        super().__init__(pane)
        self._pane = pane
        self.picture: QImage | None = None
        """The painted image; None while it is not shown."""
        self._opacity: NDArray[np.float32] | None = None
        self._shown = False
        pane.imageShown.connect(lambda _inputs, rgba: self._take(rgba))
        pane.canvas.add_decoration(self._paint)

    @property
    def box(self) -> QRectF:
        """Where in the canvas the image is painted; empty while it is not."""
        if self.picture is None:
            return QRectF()
        whole = self._pane.canvas.picture_rect
        width = SHARE * whole.width()
        height = width * self.picture.height() / self.picture.width()
        share, least = SCALE_BAR
        bottom = whole.bottom() - max(share * min(whole.width(), whole.height()), least)
        return QRectF(whole.left() + MARGIN, bottom - height, width, height)

    def set_shown(self, shown: bool) -> None:
        """Show the opacity image, or hide it."""
        self._shown = shown
        self._refresh()

    def _take(self, rgba: NDArray[np.float32]) -> None:
        self._opacity = rgba[..., 3]
        self._refresh()

    def _refresh(self) -> None:
        before = self.picture
        self.picture = None
        if self._shown and self._opacity is not None:
            self.picture = to_qimage(np.repeat(self._opacity[..., None], 4, axis=2))
        if self.picture is not before:
            self._pane.canvas.update()

    def _paint(self, painter: QPainter, _square: QRect) -> None:
        canvas = self._pane.canvas
        if self.picture is None or canvas.cover is not None:
            return
        box = self.box
        painter.drawImage(box, self.picture)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(theme.ON_IMAGE.line), 1))
        painter.drawRect(box)
        painter.setPen(QColor(theme.ON_IMAGE.dim))
        painter.drawText(box.adjusted(6, 4, -4, -4), Qt.AlignmentFlag.AlignTop, TITLE)
