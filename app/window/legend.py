"""The colour legend: which colour and which opacity the TF gives each scalar value.

It is painted over an image in the window and over exported pictures alike, and is scaled with
their size. It lies above `image_view`, as its ticks are those of the TF editor.
"""

from __future__ import annotations

from collections.abc import Callable

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
from model.scene.transfer_function import TransferFunction

TEXT_SIZE = 1 / 42
"""Height of the text relative to the shorter side of the image."""

LEAST_TEXT, MOST_HEIGHT = 10, 0.4
"""Least height of the text in pixels, and the bar's length relative to the image's height."""

LIGHT, DARK = QColor(255, 255, 255), QColor(0, 0, 0)

HALO_OPACITY = 200
"""Opacity of the halo around lines and text, of 255."""

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
    with the colours, scaled so that the largest one is as wide as it can be. Lines and text
    have a halo, so that they can be read over anything.

    Parameters
    ----------
    painter : QPainter
    rect : QRect
        The image's rectangle; in one of fewer than about 120 pixels nothing is painted.
    tf : TransferFunction
    units, name : str
        Units and name of the scalar values, written above the bar; empty if unknown.
    background : tuple of int or None
        What is behind the image: on a bright background the text is dark. None if unknown,
        as in a transparent picture.
    """
    side = min(rect.width(), rect.height())
    text = max(round(TEXT_SIZE * side), LEAST_TEXT)
    if side < 12 * text:
        return
    font = QFont(painter.font())
    font.setPixelSize(text)
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
    pens = _Pens(painter, max(text / 12, 1.0), font, _is_bright(background))
    _paint_colors(painter, bar, profile, tf, pens)
    for place, label in marks:
        y = bar.bottom() - place * length
        tick = QPainterPath(QPointF(bar.right(), y))
        tick.lineTo(bar.right() + gap, y)
        pens.stroke(tick)
        baseline = y + (metrics.ascent() - metrics.descent()) / 2
        pens.write(QPointF(bar.right() + 2 * gap, baseline), label)
    title = _title(units, name)
    if title:
        title = metrics.elidedText(title, Qt.TextElideMode.ElideRight, 0.45 * rect.width())
        x = rect.right() - margin - metrics.horizontalAdvance(title)
        pens.write(QPointF(x, bar.top() - 1.2 * text), title)
    painter.restore()


def legend_painter(
    tf: TransferFunction,
    units: str = "",
    name: str = "",
    background: Background | None = (0, 0, 0),
) -> Callable[[QPainter, QRect], None]:
    """Return a decoration of an image canvas, or of a picture, that paints a TF's legend."""

    def paint(painter: QPainter, rect: QRect) -> None:
        paint_legend(painter, rect, tf, units, name, background)

    return paint


def _title(units: str, name: str) -> str:
    if name and units:
        return f"{name} ({units})"
    return name or units


def _paint_colors(
    painter: QPainter, bar: QRectF, profile: QRectF, tf: TransferFunction, pens: _Pens
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


def _is_bright(background: Background | None) -> bool:
    if background is None:
        return False
    red, green, blue = background
    return 0.299 * red + 0.587 * green + 0.114 * blue > 140


class _Pens:
    """Draws lines and text of one colour within a halo of the other."""

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
        self._painter.strokePath(path, self._line_halo)
        self._painter.strokePath(path, self._line)

    def write(self, start: QPointF, text: str) -> None:
        path = QPainterPath()
        path.addText(start, self._font, text)
        self._painter.strokePath(path, self._text_halo)
        self._painter.fillPath(path, self._ink)
