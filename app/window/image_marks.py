"""Colour legend and scale bar, painted over an image in the window and over pictures alike.

They are scaled with the image's size, and readable over anything. They lie above `image_view`, as
the legend's ticks are those of the TF editor.
"""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFont,
    QFontMetricsF,
    QImage,
    QLinearGradient,
    QPainter,
    QPainterPath,
    QPen,
    QPolygonF,
)

from app.image_view.picture import Background
from app.tf_editor.unit_axis import ticks
from model.rendering.scale_bar import ScaleBar
from model.scene.transfer_function import TransferFunction
from model.sensitivity.display import color_bar

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
    if background is None or background == "gradient":
        return False
    red, green, blue = background
    return 0.299 * red + 0.587 * green + 0.114 * blue > 140


class Pens:
    """Draws lines and text of one colour within a halo of the other, to be seen over anything."""

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


SHADES = 256


def paint_scale_bar(
    painter: QPainter, rect: QRect, bar: ScaleBar | None, background: Background | None = (0, 0, 0)
) -> None:
    """Paint a scale bar at the lower left of an image, unless that is small or has no scale."""
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
    title: str,
    background: Background | None = (0, 0, 0),
) -> None:
    """Paint the colours of a difference at the lower right of an image, from 0 to the largest."""
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
    last = f"{largest:.2g}"
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


MOST_HEIGHT = 0.4
"""The bar's length relative to the image's height."""

SAMPLES = 256
"""Scalar values along the bar."""


def paint_legend(
    painter: QPainter,
    rect: QRect,
    tf: TransferFunction,
    units: str,
    background: Background | None = (0, 0, 0),
) -> None:
    """Paint a vertical colour bar at the lower right of an image, unless that is small.

    To the left of the TF's colours is its opacity curve, filled with the colours and as wide as it
    can be; below it is its largest opacity. A background of None is not known.
    """
    text = text_size(rect)
    if not text:
        return
    font = sized_font(painter, text)
    metrics = QFontMetricsF(font)
    length = MOST_HEIGHT * rect.height()
    marks = ticks(tf.scalar_range, max(min(int(length / (2.2 * text)), 6), 1), tf.scale)
    widest = max((metrics.horizontalAdvance(label) for _, label in marks), default=0.0)
    margin, gap = 1.2 * text, 0.4 * text
    strip, curve = 0.9 * text, 2.2 * text
    left = rect.right() - margin - widest - 2 * gap - strip
    bar = QRectF(left, rect.bottom() - margin - text / 2 - length, strip, length)
    profile = QRectF(left - 0.9 * gap - curve, bar.top(), curve, length)
    pens = _pens(painter, text, background)
    _paint_colors(painter, bar, profile, tf, pens)
    for place, label in marks:
        y = bar.bottom() - place * length
        tick = QPainterPath(QPointF(bar.right(), y))
        tick.lineTo(bar.right() + gap, y)
        pens.stroke(tick)
        baseline = y + (metrics.ascent() - metrics.descent()) / 2
        pens.write(QPointF(bar.right() + 2 * gap, baseline), label)
    title = f"Value ({units})" if units else "Value"
    title = metrics.elidedText(title, Qt.TextElideMode.ElideRight, 0.45 * rect.width())
    x = rect.right() - margin - metrics.horizontalAdvance(title)
    pens.write(QPointF(x, bar.top() - 1.2 * text), title)
    peak = float(tf.opacity.sample(count=SAMPLES).max())
    reach = f"largest opacity {peak:.2g}"
    below = QPointF(bar.right() - metrics.horizontalAdvance(reach), bar.bottom() + 1.3 * text)
    pens.write(below, reach)
    painter.restore()


def _paint_colors(
    painter: QPainter, bar: QRectF, profile: QRectF, tf: TransferFunction, pens: Pens
) -> None:
    """Paint the strip of colours and the curve of opacities, the highest value at the top."""
    # One row per value, from the top.
    colors = np.rint(255 * tf.color.sample(count=SAMPLES)[::-1]).astype(np.uint8)
    pixels = np.ascontiguousarray(colors[:, None])
    strip = QImage(pixels.data, 1, SAMPLES, 3, QImage.Format.Format_RGB888)
    outline = QPainterPath()
    outline.addRect(bar)
    pens.stroke(outline)
    painter.drawImage(bar, strip)

    opacities = tf.opacity.sample(count=SAMPLES)[::-1]
    peak = float(opacities.max())
    if peak <= 0:
        return
    heights = np.linspace(profile.top(), profile.bottom(), SAMPLES)
    edge = profile.right() - opacities / peak * profile.width()
    points = [QPointF(float(x), float(y)) for x, y in zip(edge, heights, strict=True)]
    curve = QPainterPath()
    corners = [QPointF(profile.right(), profile.top()), *points]
    curve.addPolygon(QPolygonF([*corners, QPointF(profile.right(), profile.bottom())]))
    curve.closeSubpath()
    gradient = QLinearGradient(profile.topLeft(), profile.bottomLeft())
    for index in range(0, SAMPLES, 5):
        gradient.setColorAt(index / (SAMPLES - 1), QColor(*map(int, colors[index])))
    pens.stroke(curve)
    painter.fillPath(curve, QBrush(gradient))
