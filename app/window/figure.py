"""Figures: images as they are saved, side by side or compared, and the marks over them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
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

from app.image_view.image_canvas import to_qimage
from app.image_view.picture import BLACK, Background, compose, empty_picture
from app.tf_editor.unit_axis import ticks
from model.rendering.raster import at_size_of
from model.rendering.scale_bar import Scale, ScaleBar
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import TransferFunction
from model.scene.view import Projection, View
from model.scene.volume import Triple
from model.sensitivity.display import LEAST_DIFFERENCE, Measure, color_bar, overlay, scale_of

TEXT_SIZE = 1 / 42  # height of the text relative to the shorter side of the image
LEAST_TEXT = 10  # least height of the text in pixels
LEAST_LINES = 12  # lines of text that must fit into an image for anything to be painted over it

LIGHT, DARK = QColor(255, 255, 255), QColor(0, 0, 0)

HALO_OPACITY = 200  # opacity of the halo around lines and text, of 255


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
    painter: QPainter, rect: QRect, bar: ScaleBar | None, background: Background | None = BLACK
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


def paint_line(
    painter: QPainter,
    rect: QRect,
    subject: Subject,
    view: View,
    background: Background | None = BLACK,
) -> None:
    """Paint the line that is measured over an image, with its length; or its first end alone."""
    text, scale = text_size(rect), subject.scale
    if not text or scale is None or not subject.line:
        return
    projection, points = Projection(view, scale.proportions), np.array(subject.line)
    ends = projection.seen_part(points[0], points[-1])
    if ends is None:
        return
    half, middle = min(rect.width(), rect.height()) / 2, QRectF(rect).center()
    places = [middle + QPointF(half * x, -half * y) for x, y in projection.places(ends)]
    pens, path = _pens(painter, text, background), QPainterPath(places[0])
    path.lineTo(places[-1])
    for place in places:
        path.addEllipse(place, 0.25 * text, 0.25 * text)
    pens.stroke(path)
    if len(points) > 1:
        # Where it does not lie over the line.
        right = max(places, key=QPointF.x)
        at = right + QPointF(0.7 * text, 0.35 * text)
        pens.write(at, scale.length_text(points[0], points[1]))
    painter.restore()


def paint_difference_bar(
    painter: QPainter, rect: QRect, compared: Comparison, background: Background | None = BLACK
) -> None:
    """Paint the colours of a difference at the lower right of an image, with their ends."""
    text = text_size(rect)
    if not text:
        return
    pens = _pens(painter, text, background)
    metrics = QFontMetricsF(sized_font(painter, text))
    width = min(12 * text, 0.4 * rect.width())
    right, bottom = rect.right() - 1.2 * text, rect.bottom() - 2.6 * text
    bar = QRectF(right - width, bottom - 0.9 * text, width, 0.9 * text)
    outline = QPainterPath()
    outline.addRect(bar)
    pens.stroke(outline)
    painter.drawImage(bar, to_qimage(color_bar(compared.measure, SHADES)[None]))
    first, last = compared.ends
    title = metrics.elidedText(
        compared.title, Qt.TextElideMode.ElideRight, rect.width() - 2.4 * text
    )
    pens.write(
        QPointF(bar.right() - metrics.horizontalAdvance(title), bar.top() - 0.5 * text), title
    )
    pens.write(QPointF(bar.left(), bar.bottom() + 1.2 * text), first)
    pens.write(
        QPointF(bar.right() - metrics.horizontalAdvance(last), bar.bottom() + 1.2 * text), last
    )
    painter.restore()


def paint_caption(
    painter: QPainter, rect: QRect, caption: str, background: Background | None = BLACK
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


MOST_HEIGHT = 0.4  # the bar's length relative to the image's height
SAMPLES = 256  # scalar values along the bar


def paint_legend(
    painter: QPainter,
    rect: QRect,
    tf: TransferFunction,
    units: str,
    background: Background | None = BLACK,
) -> None:
    """Paint colour bar and opacity curve, with its largest value, at an image's lower right."""
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
    colors = tf.color.sample(count=SAMPLES)[::-1]
    outline = QPainterPath()
    outline.addRect(bar)
    pens.stroke(outline)
    painter.drawImage(bar, to_qimage(colors[:, None]))

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
        gradient.setColorAt(index / (SAMPLES - 1), QColor.fromRgbF(*map(float, colors[index])))
    pens.stroke(curve)
    painter.fillPath(curve, QBrush(gradient))


Which = Literal["generator", "reference", "b", "both", "difference", "a_b", "a_b_difference"]
"""Contents of a figure: an image, two side by side, how far they are apart, or all of that."""

PANELS: dict[Which, tuple[str, ...]] = {
    "generator": ("generator",),
    "reference": ("reference",),
    "b": ("b",),
    "both": ("generator", "reference"),
    "difference": ("difference",),
    "a_b": ("reference", "b"),
    "a_b_difference": ("reference", "b", "difference"),
}
"""Images and difference of a figure, from left to right."""

TITLES = {"generator": "Generator", "reference": "Ground truth"}
TITLES_AB = {"reference": "A", "b": "B", "difference": "B − A"}

GAP = 1 / 100  # distance of two images, relative to the figure's width

Image = NDArray[np.float32]
Rgba = Image | NDArray[np.uint8]
Size = tuple[int, int]


@dataclass(frozen=True)
class FigureLook:
    """Look of a figure; its size is in pixels, and no background is a transparent one."""

    width: int
    height: int
    background: Background | None = BLACK
    legend: bool = False
    scale_bar: bool = False


@dataclass(frozen=True)
class FigureChoice(FigureLook):
    """Choices for a figure or movie that is saved.

    Samples are of each pixel of a path-traced ground truth, 0 in other light. A movie of one full
    turn has a length in seconds, 0 for a figure, and a rate in frames a second.
    """

    which: Which = "reference"
    samples: int = 0
    seconds: float = 0.0
    rate: int = 25

    @property
    def frame_count(self) -> int:
        """Number of pictures of a movie; 0 for a figure."""
        return max(round(self.seconds * self.rate), 2) if self.seconds else 0


@dataclass(frozen=True)
class Subject:
    """Unit of a volume's scalars, empty if unknown, scale for its scale bar, and what the
    generator's pane shows.
    """

    units: str = ""
    scale: Scale | None = None
    title: str = TITLES["generator"]
    line: tuple[Triple, ...] = ()  # one or two points that are measured, in fractions


def panels(look: FigureLook, which: Which) -> list[QRect]:
    """Return where the images of a figure are, side by side."""
    gaps = len(PANELS[which]) - 1
    gap = max(round(GAP * look.width), 1)
    width = (look.width - gaps * gap) // (gaps + 1)
    lefts = [number * (look.width - width) // max(gaps, 1) for number in range(gaps + 1)]
    return [QRect(left, 0, width, look.height) for left in lefts]


def figure(
    look: FigureLook,
    images: Mapping[str, tuple[Rgba, float]],
    which: Which,
    inputs: SceneInputs,
    subject: Subject,
    tf_b: TransferFunction | None = None,
) -> QImage:
    """Return a figure of images and brightness by name; raise RenderError for lack of memory."""
    names, compared = PANELS[which], None
    shown = []
    for name in names:
        if name == "difference":
            compared = Comparison.of(images)
            shown.append((name, _opaque(compared.colored)))
        else:
            shown.append((name, compose(images[name][0], look.background, images[name][1])))
    titles = TITLES_AB if "b" in names else TITLES | {"generator": subject.title}
    places = panels(look, which)
    if len(shown) == 1 and (shown[0][1].width(), shown[0][1].height()) == (look.width, look.height):
        result = shown[0][1]
    else:
        result = empty_picture(look.width, look.height, look.background)
    painter = QPainter(result)
    painter.setRenderHints(
        QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform
    )
    rects = []
    for (name, image), place in zip(shown, places, strict=True):
        rect = _fitted(image, place)
        rects.append(rect)
        if image is not result:
            smooth = image.scaled(
                rect.size(),
                Qt.AspectRatioMode.IgnoreAspectRatio,
                Qt.TransformationMode.SmoothTransformation,
            )
            painter.drawImage(rect, smooth)
        # The difference is opaque, on black.
        background = (0, 0, 0) if name == "difference" else look.background
        if len(names) > 1:
            paint_caption(painter, rect, titles[name], background)
        if name == "difference" and compared is not None:
            paint_difference_bar(painter, rect, compared, background)
        elif look.legend and (name == names[-1] or "b" in names):
            tf = (tf_b if name == "b" else None) or inputs.transfer_function
            paint_legend(painter, rect, tf, subject.units, background)
    background = (0, 0, 0) if names[0] == "difference" else look.background
    if look.scale_bar and subject.scale is not None:
        bar = subject.scale.bar(inputs.view, inputs.part)
        paint_scale_bar(painter, rects[0], bar, background)
    for rect in rects:
        paint_line(painter, rect, subject, inputs.view, background)
    painter.end()
    return result


def pixels_of(image: QImage) -> NDArray[np.uint8]:
    """Return an opaque picture's pixels as uint8 (H, W, 3)."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    stored = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())
    pixels = stored[:, : 3 * rgb.width()].reshape(rgb.height(), rgb.width(), 3)
    return pixels.copy()


LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of red, green and blue


@dataclass(frozen=True, eq=False)
class Comparison:
    """Comparison of two images (H, W, 3): of a generator's and the truth, or, signed, of B and A.

    The truth is mostly finer than the generator's: what it shows in the middle of a pixel of the
    generator's is compared. Means would count what any image of so few pixels lacks.
    """

    drawn: Image
    truth: Image
    is_signed: bool = False

    @classmethod
    def of(cls, images: Mapping[str, tuple[Rgba, float]]) -> Comparison:
        """Compare images of a figure by their names, in colours of 0..1 or 0..255."""
        name = "b" if "b" in images else "generator"
        drawn, truth = (_colors(images[each][0]) for each in (name, "reference"))
        return cls(drawn, truth, is_signed=name == "b")

    @property
    def measure(self) -> Measure:
        """Measure of the colours of the difference."""
        return "signed" if self.is_signed else "change"

    @cached_property
    def apart(self) -> NDArray[np.float64]:
        """Differences of the colours of each of the drawn image's pixels, (H, W, 3)."""
        # Not by model.metrics: it imports torch and more, without which the window starts.
        one, other = (np.clip(np.nan_to_num(image), 0, 1) for image in (self.drawn, self.truth))
        sampled = np.clip(at_size_of(one, other, sampled=True), 0, 1)
        return one.astype(np.float64) - sampled

    @property
    def error(self) -> float:
        """Root mean square of all differences."""
        return float(np.sqrt(np.mean(self.apart**2)))

    @cached_property
    def difference(self) -> NDArray[np.float64]:
        """Difference of each pixel (H, W): of luminance if signed, else the RMS of its colours."""
        if self.is_signed:
            return self.apart @ LUMINANCE
        return np.sqrt(np.mean(self.apart**2, axis=-1))

    @cached_property
    def scale(self) -> float:
        """Difference of the last colour."""
        return scale_of(self.difference, LEAST_DIFFERENCE)

    @property
    def colored(self) -> NDArray[np.float64]:
        """The drawn image with the difference over it, (H, W, 3)."""
        return overlay(np.clip(self.drawn, 0, 1), self.difference, self.scale, self.measure)

    @property
    def ends(self) -> tuple[str, str]:
        """Differences of the first and the last colour."""
        last = f"{self.scale:.2g}"
        return (f"−{last}", f"+{last}") if self.is_signed else ("0", last)

    @property
    def title(self) -> str:
        """Meaning of the colours."""
        height, width = self.difference.shape
        what = "luminance of B − A" if self.is_signed else "difference from the ground truth"
        return f"{what} at {width} × {height} pixels"


def _colors(rgba: Rgba) -> Image:
    full = 255 if rgba.dtype == np.uint8 else 1
    return np.asarray(rgba[..., :3], np.float32) / np.float32(full)


def _opaque(colored: NDArray[np.float64]) -> QImage:
    return compose(np.dstack([colored, np.ones(colored.shape[:2])]).astype(np.float32), (0, 0, 0))


def _fitted(image: QImage, place: QRect) -> QRect:
    """Return the largest rectangle of an image's proportions in the middle of a place."""
    size = image.size().scaled(place.size(), Qt.AspectRatioMode.KeepAspectRatio)
    rect = QRect(0, 0, size.width(), size.height())
    rect.moveCenter(place.center())
    return rect
