"""Lines and text over pictures: of one size relative to these, and readable over anything."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRect, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPainterPath, QPen

from app.image_view.picture import Background

TEXT_SIZE = 1 / 42
"""Height of the text relative to the shorter side of the image."""

LEAST_TEXT = 10
"""Least height of the text in pixels."""

LEAST_LINES = 12
"""Lines of text that must fit into an image for anything to be painted over it."""

LIGHT, DARK = QColor(255, 255, 255), QColor(0, 0, 0)

HALO_OPACITY = 200
"""Opacity of the halo around lines and text, of 255."""


def text_size(rect: QRect) -> int:
    """Height of the text over an image in pixels; 0 for one that is too small for any."""
    side = min(rect.width(), rect.height())
    text = max(round(TEXT_SIZE * side), LEAST_TEXT)
    return text if side >= LEAST_LINES * text else 0


def sized_font(painter: QPainter, text: int) -> QFont:
    """Return the painter's font in another size, in pixels."""
    font = QFont(painter.font())
    font.setPixelSize(text)
    return font


def is_bright(background: Background | None) -> bool:
    """Whether text over a background has to be dark; unknown ones are taken for dark."""
    if background is None:
        return False
    red, green, blue = background
    return 0.299 * red + 0.587 * green + 0.114 * blue > 140


class Pens:
    """Draws lines and text of one colour within a halo of the other, to be seen over anything.

    Parameters
    ----------
    line : float
        Width of lines in pixels.
    font : QFont
        With a size in pixels.
    on_bright : bool
        Whether what lies behind is bright.
    """

    def __init__(self, painter: QPainter, line: float, font: QFont, on_bright: bool) -> None:
        self._painter = painter
        self._font = font
        self._ink, halo = (DARK, QColor(LIGHT)) if on_bright else (LIGHT, QColor(DARK))
        halo.setAlpha(HALO_OPACITY)
        self._line = QPen(self._ink, line)
        self._line_halo = QPen(halo, 3 * line)
        self._text_halo = QPen(halo, font.pixelSize() / 4)
        for pen in (self._line, self._line_halo, self._text_halo):
            pen.setJoinStyle(Qt.PenJoinStyle.RoundJoin)

    def stroke(self, path: QPainterPath) -> None:
        """Draw a line."""
        self._painter.strokePath(path, self._line_halo)
        self._painter.strokePath(path, self._line)

    def write(self, start: QPointF, text: str) -> None:
        """Write a text whose first letter begins at a point of the base line."""
        path = QPainterPath()
        path.addText(start, self._font, text)
        self._painter.strokePath(path, self._text_halo)
        self._painter.fillPath(path, self._ink)
