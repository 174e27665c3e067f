"""The scale bar, and the scale of a difference, painted over an image or a picture."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF
from PySide6.QtGui import QFontMetricsF, QImage, QPainter, QPainterPath

from app.image_view.picture import Background
from app.window.difference import meaning
from app.window.pens import Pens, is_bright, sized_font, text_size
from model.rendering.scale_bar import ScaleBar
from model.sensitivity.display import color_bar

SHADES = 256


def paint_scale_bar(
    painter: QPainter, rect: QRect, bar: ScaleBar | None, background: Background | None = (0, 0, 0)
) -> None:
    """Paint a scale bar at the lower left of an image, with its length above it.

    Parameters
    ----------
    rect : QRect
        The image's rectangle, whose shorter side the bar refers to; in one of fewer than about
        120 pixels nothing is painted.
    bar : ScaleBar or None
        None where no length can be told.
    background : tuple of int or None
        As for :func:`app.window.legend.paint_legend`.
    """
    text = text_size(rect)
    if not text or bar is None:
        return
    pens = _pens(painter, text, background)
    length = bar.share * min(rect.width(), rect.height())
    left, bottom = rect.left() + 1.2 * text, rect.bottom() - 1.2 * text
    end = 0.35 * text
    path = QPainterPath(QPointF(left, bottom - end))
    for x, y in ((left, bottom), (left + length, bottom), (left + length, bottom - end)):
        path.lineTo(x, y)
    pens.stroke(path)
    metrics = QFontMetricsF(sized_font(painter, text))
    # In the middle of the bar, but not beyond the image's edge where it is short.
    start = max(left + (length - metrics.horizontalAdvance(bar.text)) / 2, rect.left() + 0.4 * text)
    pens.write(QPointF(start, bottom - end - 0.45 * text), bar.text)
    painter.restore()


def paint_difference_bar(
    painter: QPainter,
    rect: QRect,
    largest: float,
    pixels: int,
    background: Background | None = (0, 0, 0),
) -> None:
    """Paint the colours of a difference at the lower right of an image, from 0 to the largest.

    It says how many pixels along a side were compared.
    """
    text = text_size(rect)
    if not text:
        return
    pens = _pens(painter, text, background)
    colors = np.rint(255 * color_bar("change", SHADES)).astype(np.uint8)[None]
    strip = QImage(
        np.ascontiguousarray(colors).data, SHADES, 1, 3 * SHADES, QImage.Format.Format_RGB888
    )
    metrics = QFontMetricsF(sized_font(painter, text))
    width = min(12 * text, 0.4 * rect.width())
    right, bottom = rect.right() - 1.2 * text, rect.bottom() - 2.6 * text
    bar = QRectF(right - width, bottom - 0.9 * text, width, 0.9 * text)
    outline = QPainterPath()
    outline.addRect(bar)
    pens.stroke(outline)
    painter.drawImage(bar, strip)
    title, last = meaning(pixels), f"{largest:.2g}"
    pens.write(
        QPointF(bar.right() - metrics.horizontalAdvance(title), bar.top() - 0.5 * text), title
    )
    pens.write(QPointF(bar.left(), bar.bottom() + 1.2 * text), "0")
    pens.write(
        QPointF(bar.right() - metrics.horizontalAdvance(last), bar.bottom() + 1.2 * text), last
    )
    painter.restore()


def paint_caption(
    painter: QPainter, rect: QRect, caption: str, background: Background | None = (0, 0, 0)
) -> None:
    """Write what an image is at its upper left."""
    text = text_size(rect)
    if not text:
        return
    pens = _pens(painter, text, background)
    pens.write(QPointF(rect.left() + 1.2 * text, rect.top() + 2 * text), caption)
    painter.restore()


def _pens(painter: QPainter, text: int, background: Background | None) -> Pens:
    """Save the painter's state, and return pens for lines and text over an image."""
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    # A rendering may use any composition; this is always painted over it.
    painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceOver)
    return Pens(painter, max(text / 12, 1.0), sized_font(painter, text), is_bright(background))
