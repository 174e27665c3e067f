"""The colour bar of a field, painted over its image."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QRect, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen

from app import theme
from model.sensitivity.display import Shown, color_bar
from model.sensitivity.global_scale import global_color_bar

WIDTH, HEIGHT, MARGIN = 150, 9, 12

ROOM = 60
"""Height of the lines above the bar, at most, in pixels."""


def paint_bar(
    painter: QPainter,
    rect: QRect,
    right: int,
    measure: Shown,
    text: str,
    is_global: bool = False,
) -> None:
    """Paint a colour bar into the lower left corner of an image.

    Parameters
    ----------
    painter : QPainter
    rect : QRect
        The image.
    right : int
        Where the text has to end.
    measure : {"change", "signed", "visible"}
        Whose colours it has.
    text : str
        Says above the bar what its ends are; in two lines where one is too long.
    is_global : bool
        Whether it is the scale of the fields of all values, from 0.
    """
    shades = global_color_bar(WIDTH) if is_global else color_bar(measure, WIDTH)
    colors = np.rint(255 * shades).astype(np.uint8)[None]
    bar = QImage(
        np.ascontiguousarray(colors).data, WIDTH, 1, 3 * WIDTH, QImage.Format.Format_RGB888
    ).copy()
    x, y = rect.left() + MARGIN, rect.bottom() - MARGIN - HEIGHT
    painter.drawImage(QRectF(x, y, WIDTH, HEIGHT), bar)
    painter.setPen(QPen(QColor(theme.ON_IMAGE.dim), 1))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(QRectF(x, y, WIDTH, HEIGHT))
    painter.setPen(QColor(theme.ON_IMAGE.text))
    flags = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap
    painter.drawText(QRectF(x, y - 4 - ROOM, right - MARGIN - x, ROOM), flags, text)
