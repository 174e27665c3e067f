"""The colour legend: which colour and which opacity the TF gives each scalar value.

It is painted over an image in the window and over exported pictures alike, and is scaled with
their size. It lies above `image_view`, as its ticks are those of the TF editor.
"""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFontMetricsF,
    QImage,
    QLinearGradient,
    QPainter,
    QPainterPath,
    QPolygonF,
)

from app.image_view.picture import Background
from app.tf_editor.unit_axis import ticks
from app.window.pens import Pens, is_bright, sized_font, text_size
from model.scene.transfer_function import TransferFunction

MOST_HEIGHT = 0.4
"""The bar's length relative to the image's height."""

SAMPLES = 256
"""Scalar values along the bar."""


def paint_legend(
    painter: QPainter,
    rect: QRect,
    tf: TransferFunction,
    units: str = "",
    name: str = "",
    background: Background | None = (0, 0, 0),
) -> None:
    """Paint a vertical colour bar at the lower right of an image.

    Beside the strip with the TF's colours its opacities are drawn as a curve that is filled
    with the colours, scaled so that the largest one is as wide as it can be; below it is which
    one that is. Lines and text have a halo, so that they can be read over anything.

    Parameters
    ----------
    rect : QRect
        The image's rectangle; in one of fewer than about 120 pixels nothing is painted.
    units, name : str
        Units and name of the scalar values, written above the bar as the axis' title; empty if
        unknown.
    background : tuple of int or None
        What is behind the image: on a bright background the text is dark. None if unknown,
        as in a transparent picture.
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
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    # A rendering may use any composition; the legend is always painted over it.
    painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceOver)
    pens = Pens(painter, max(text / 12, 1.0), font, is_bright(background))
    _paint_colors(painter, bar, profile, tf, pens)
    for place, label in marks:
        y = bar.bottom() - place * length
        tick = QPainterPath(QPointF(bar.right(), y))
        tick.lineTo(bar.right() + gap, y)
        pens.stroke(tick)
        baseline = y + (metrics.ascent() - metrics.descent()) / 2
        pens.write(QPointF(bar.right() + 2 * gap, baseline), label)
    title = _title(units, name)
    title = metrics.elidedText(title, Qt.TextElideMode.ElideRight, 0.45 * rect.width())
    x = rect.right() - margin - metrics.horizontalAdvance(title)
    pens.write(QPointF(x, bar.top() - 1.2 * text), title)
    peak = float(tf.opacity.sample(count=SAMPLES).max())
    reach = f"opacity to {peak:.2g}"
    below = QPointF(bar.right() - metrics.horizontalAdvance(reach), bar.bottom() + 1.3 * text)
    pens.write(below, reach)
    painter.restore()


def _title(units: str, name: str) -> str:
    return f"{name or 'Value'} ({units})" if units else name or "Value"


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
