"""A small picture of one slice of a volume, with a caption."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app import theme

SIZE = 220
"""Least width of the picture, in pixels."""

CAPTION_HEIGHT = 22


class SlicePreview(QWidget):
    """Shows a slice as large as possible in its true proportions.

    Parameters
    ----------
    caption : str
        Text below the picture.
    """

    def __init__(self, caption: str) -> None:
        super().__init__()
        self._caption = caption
        self._image: QImage | None = None
        self._proportions = (1.0, 1.0)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    @property
    def image(self) -> QImage | None:
        """Displayed slice, one pixel a value; None if there is none."""
        return self._image

    def show_slice(self, levels: NDArray[np.uint8], width: float, height: float) -> None:
        """Show a slice.

        Parameters
        ----------
        levels : ndarray of uint8, shape (H, W)
        width, height : float
            Lengths of the slice, in any unit.
        """
        rows, columns = levels.shape
        stored = np.ascontiguousarray(levels)
        # The copy makes the image own its pixels.
        self._image = QImage(
            stored.data, columns, rows, columns, QImage.Format.Format_Grayscale8
        ).copy()
        self._proportions = (width, height)
        self.update()

    def clear(self) -> None:
        """Show nothing but the caption."""
        self._image = None
        self.update()

    def sizeHint(self) -> QSize:
        """Return the size at which three fit side by side on a laptop's screen."""
        return QSize(SIZE, SIZE + CAPTION_HEIGHT)

    def minimumSizeHint(self) -> QSize:
        """Return the same."""
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the slice and the caption."""
        painter = QPainter(self)
        frame = self.rect().adjusted(0, 0, 0, -CAPTION_HEIGHT)
        painter.setRenderHints(
            QPainter.RenderHint.SmoothPixmapTransform | QPainter.RenderHint.Antialiasing
        )
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.CANVAS))
        painter.drawRoundedRect(frame, 6, 6)
        if self._image is not None:
            width, height = self._proportions
            scale = min(frame.width() / width, frame.height() / height)
            place = QRect(0, 0, max(round(width * scale), 1), max(round(height * scale), 1))
            place.moveCenter(frame.center())
            painter.drawImage(place, self._image)
        painter.setPen(QColor(theme.DIM_TEXT))
        caption = QRect(0, frame.height(), self.width(), CAPTION_HEIGHT)
        painter.drawText(caption, Qt.AlignmentFlag.AlignCenter, self._caption)
        painter.end()
