"""Figures: images to save, side by side or compared, and the marks over them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt
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

from app.image_view.image_canvas import centred, picture_on, to_qimage
from app.number_box import short
from app.picture import BLACK, DPI, WHITE, Background, compose, empty_picture, is_bright
from app.tf_editor.unit_axis import ticks
from model.rendering.raster import at_size_of
from model.rendering.scale_bar import Scale, ScaleBar
from model.scene.inputs import SceneInputs
from model.scene.tf_editing import opacity_handles
from model.scene.transfer_function import TransferFunction
from model.scene.view import Projection, View
from model.scene.volume import Triple
from model.sensitivity.display import LEAST_DIFFERENCE, Shown, color_bar, overlay, scale_of

PRINTED, PAGE = 8 / 72, 180 / 25.4  # height of a figure's text and width of a page, in inches
MOST_TEXT = 1 / 26  # of an image's shorter side: larger text would cover what it shows
BESIDE, BETWEEN = 9.0, 3.6  # width of a legend to the right of images, and of a second TF, in texts
BELOW = 5.4  # height of a difference's colours below images, in texts
LEAST_TEXT = 8  # pixels
LEAST_SIDE = 120  # in pixels: a smaller image has no marks

LIGHT, DARK = QColor(255, 255, 255), QColor(0, 0, 0)

HALO_OPACITY = 200  # opacity of the halo around lines and text, of 255


Legend = Mapping[str, TransferFunction]  # over one range; named A and B if there are two


def legend_of(a: TransferFunction, b: TransferFunction | None = None) -> Legend:
    """Return the legend of one or two TFs; equal ones are one."""
    return {"": a} if b is None or b == a else {"A": a, "B": b}


LENGTH = 0.4  # of a legend, relative to the image's shorter side
SAMPLES = 256  # colours of a bar, and scalar values along a legend


class Marks:
    """Paints marks over an image, black or white with a halo of the other."""

    @classmethod
    def over(
        cls, painter: QPainter, rect: QRect, text: int, background: Background | None = BLACK
    ) -> Marks | None:
        """Return the marks of an image in a rectangle; None if it is too small for them."""
        is_large = min(rect.width(), rect.height()) >= LEAST_SIDE
        return cls(painter, rect, text, background) if is_large else None

    def __init__(
        self, painter: QPainter, rect: QRect, text: int, background: Background | None
    ) -> None:
        self._painter, self._rect, self._text = painter, rect, text
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        # A rendering may use any composition mode; marks are always painted over it.
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceOver)
        self._font = QFont(painter.font())
        self._font.setPixelSize(text)
        self._metrics = QFontMetricsF(self._font)
        is_dark = not is_bright(background)
        self._ink, halo = (LIGHT, QColor(DARK)) if is_dark else (DARK, QColor(LIGHT))
        halo.setAlpha(HALO_OPACITY)
        line = max(text / 12, 1.0)
        self._line = QPen(self._ink, line)
        self._line_halo = QPen(halo, 3 * line)
        self._text_halo = QPen(halo, text / 4)
        for pen in (self._line, self._line_halo, self._text_halo):
            pen.setJoinStyle(Qt.PenJoinStyle.RoundJoin)

    def caption(self, text: str, share: float = 0.0) -> None:
        """Paint the image's caption at its upper left, or right of a line at a share of it."""
        x, top = self._rect.left() + share * self._rect.width(), self._rect.top()
        if share:
            line = QPainterPath(QPointF(x, top))
            line.lineTo(x, top + self._rect.height())
            self._stroke(line)
        self._write(x + 1.2 * self._text, top + 2 * self._text, text)

    def scale_bar(self, bar: ScaleBar | None) -> None:
        """Paint a scale bar at the lower left if there is a scale."""
        if bar is None:
            return
        text, rect = self._text, self._rect
        length = bar.share * min(rect.width(), rect.height())
        left, bottom, end = rect.left() + 1.2 * text, rect.bottom() - 1.2 * text, 0.35 * text
        path = QPainterPath(QPointF(left, bottom - end))
        for x, y in ((left, bottom), (left + length, bottom), (left + length, bottom - end)):
            path.lineTo(x, y)
        self._stroke(path)
        # In the middle of the bar, but within the image.
        start = max(left + (length - self._width_of(bar.text)) / 2, rect.left() + 0.4 * text)
        self._write(start, bottom - end - 0.45 * text, bar.text)

    def line(self, subject: Subject, view: View) -> None:
        """Paint the ruler's line in an image."""
        if subject.scale is None or not subject.line:
            return
        projection, points = Projection(view, subject.scale.proportions), np.array(subject.line)
        ends = projection.seen_part(points[0], points[-1])
        if ends is not None:
            half = min(self._rect.width(), self._rect.height()) / 2
            middle, places = QRectF(self._rect).center(), projection.places(ends)
            self.ruler(subject, [middle + QPointF(half * x, -half * y) for x, y in places])

    def ruler(self, subject: Subject, places: Sequence[QPointF]) -> None:
        """Paint the ruler's line between two places with its length, or its first end alone."""
        text, path = self._text, QPainterPath(places[0])
        path.lineTo(places[-1])
        for place in places:
            path.addEllipse(place, 0.25 * text, 0.25 * text)
        self._stroke(path)
        if subject.scale is not None and len(subject.line) > 1:
            length, right = subject.scale.length_text(*subject.line), max(places, key=QPointF.x)
            # Next to the line; if there is no room, above its end.
            x, most = right.x() + 0.7 * text, self._rect.right() - self._width_of(length) - text
            self._write(min(x, most), right.y() + (0.35 if x <= most else -0.7) * text, length)

    def difference_bar(self, compared: Comparison, background: Background | None) -> None:
        """Paint the colours of a difference at the lower right, with their ends."""
        text, rect = self._text, self._rect
        width = min(12 * text, 0.4 * rect.width())
        right, bottom = rect.right() - 1.2 * text, rect.bottom() - 2.6 * text
        bar = QRectF(right - width, bottom - 0.9 * text, width, 0.9 * text)
        self._frame(bar)
        self._painter.drawImage(bar, compared.bar(background))
        first, last = compared.ends
        title = self._elided(compared.title, rect.width() - 2.4 * text)
        self._write_before(bar.right(), bar.top() - 0.5 * text, title)
        self._write(bar.left(), bar.bottom() + 1.2 * text, first)
        self._write_before(bar.right(), bar.bottom() + 1.2 * text, last)

    def legend(self, tfs: Legend, units: str) -> None:
        """Paint TFs at the lower right: colours, opacities, largest opacity, names, and values."""
        text, rect, tf = self._text, self._rect, next(iter(tfs.values()))
        length = LENGTH * min(rect.width(), rect.height())
        marks = ticks(tf.scalar_range, max(min(int(length / (2.2 * text)), 6), 1), tf.scale)
        widest = max((self._width_of(label) for _, label in marks), default=0.0)
        margin, gap, strip, curve = 1.2 * text, 0.4 * text, 0.8 * text, 1.8 * text
        left = rect.right() - margin - widest - 2 * gap - strip
        bar = QRectF(left, rect.bottom() - margin - text / 2 - length, strip, length)
        peaks: list[str] = []
        for number, (name, each) in enumerate(reversed(list(tfs.items()))):
            own = bar.translated(-number * (strip + curve + 2.5 * gap), 0)
            profile = QRectF(own.left() - 0.9 * gap - curve, own.top(), curve, length)
            self._paint_colors(own, profile, each)
            self._write(own.center().x() - self._width_of(name) / 2, own.top() - 0.4 * text, name)
            places = np.clip([at for at, _ in opacity_handles(each.opacity)], *each.scalar_range)
            highest = max(each.opacity.sample().max(), each.opacity(places).max(initial=0.0))
            peaks.insert(0, f"{name} {short(float(highest), 3)}".strip())
        for place, label in marks:
            y = bar.bottom() - place * length
            tick = QPainterPath(QPointF(bar.right(), y))
            tick.lineTo(bar.right() + gap, y)
            self._stroke(tick)
            baseline = y + (self._metrics.ascent() - self._metrics.descent()) / 2
            self._write(bar.right() + 2 * gap, baseline, label)
        title = self._elided(f"Value ({units})" if units else "Value", 0.45 * rect.width())
        above = (1.2 if len(tfs) == 1 else 1.8) * text
        self._write_before(rect.right() - margin, bar.top() - above, title)
        reach = f"highest opacity: {', '.join(peaks)}"
        self._write_before(rect.right() - margin, bar.bottom() + 1.3 * text, reach)

    def _paint_colors(self, bar: QRectF, profile: QRectF, tf: TransferFunction) -> None:
        """Paint the strip of colours and the curve of opacities, the highest value at the top."""
        # One row per value, from the top.
        colors, opacities = (each.sample(count=SAMPLES)[::-1] for each in (tf.color, tf.opacity))
        self._frame(bar)
        self._painter.drawImage(bar, to_qimage(colors[:, None]))
        peak = float(opacities.max())
        if peak <= 0:
            return
        heights = np.linspace(profile.top(), profile.bottom(), SAMPLES)
        edge = profile.right() - opacities / peak * profile.width()
        points = [QPointF(float(x), float(y)) for x, y in zip(edge, heights, strict=True)]
        curve = QPainterPath()
        curve.addPolygon(QPolygonF([profile.topRight(), *points, profile.bottomRight()]))
        curve.closeSubpath()
        gradient = QLinearGradient(profile.topLeft(), profile.bottomLeft())
        for index in range(0, SAMPLES, 5):
            gradient.setColorAt(index / (SAMPLES - 1), QColor.fromRgbF(*map(float, colors[index])))
        self._stroke(curve)
        self._painter.fillPath(curve, QBrush(gradient))

    def _stroke(self, path: QPainterPath) -> None:
        self._painter.strokePath(path, self._line_halo)
        self._painter.strokePath(path, self._line)

    def _frame(self, box: QRectF) -> None:
        path = QPainterPath()
        path.addRect(box)
        self._stroke(path)

    def _write(self, x: float, y: float, text: str) -> None:
        """Paint a text that starts at a point of the base line."""
        path = QPainterPath()
        path.addText(QPointF(x, y), self._font, text)
        self._painter.strokePath(path, self._text_halo)
        self._painter.fillPath(path, self._ink)

    def _write_before(self, right: float, y: float, text: str) -> None:
        self._write(right - self._width_of(text), y, text)

    def _width_of(self, text: str) -> float:
        return self._metrics.horizontalAdvance(text)

    def _elided(self, text: str, width: float) -> str:
        return self._metrics.elidedText(text, Qt.TextElideMode.ElideRight, width)


Which = Literal[
    "generator", "reference", "b", "both", "difference", "wiped", "a_b", "a_b_difference"
]
"""Contents of a figure: one image or two, their difference, or all of these."""

CONTENTS: dict[Which, tuple[str, tuple[str, ...]]] = {
    "reference": ("Ground truth", ("reference",)),
    "generator": ("Generator", ("generator",)),
    "both": ("Both, side by side", ("generator", "reference")),
    "difference": ("Difference", ("difference",)),
    "b": ("B", ("b",)),
    "wiped": ("A and B, wiped", ("reference", "b")),
    "a_b": ("A and B, side by side", ("reference", "b")),
    "a_b_difference": ("A, B and their difference", ("reference", "b", "difference")),
}
"""Contents of a figure by name: its images and difference, from left to right."""

TITLES = {"generator": "Generator", "reference": "Ground truth", "b": "B"}

GAP = 1 / 100  # gap between two images, relative to the figure's width

Image = NDArray[np.float32]
Rgba = Image | NDArray[np.uint8]
Size = tuple[int, int]


@dataclass(frozen=True)
class FigureChoice:
    """Choices for a figure, or for a movie of one full turn."""

    width: int  # in pixels
    height: int
    background: Background | None = BLACK  # None is a transparent one
    legend: bool = False
    scale_bar: bool = False
    which: Which = "reference"
    samples: int = 0  # of each pixel of a path-traced ground truth; 0 without path tracing
    seconds: float = 0.0  # of a movie; 0 for a figure
    rate: int = 25  # frames a second
    session: bool = True  # whether a PNG file holds the session
    is_beside: bool = True  # whether the legend is next to the images, not over them

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its images and difference, from left to right."""
        return CONTENTS[self.which][1]

    @property
    def text(self) -> int:
        """Height of its texts in pixels; that of a wider figure is reduced to a page."""
        count = 1 if self.which == "wiped" else len(self.names)
        printed = PRINTED * max(DPI, self.width / PAGE)
        shorter = min(self.width / count, self.height)
        return round(max(min(printed, MOST_TEXT * shorter), LEAST_TEXT))

    @property
    def frame_count(self) -> int:
        """Number of pictures of a movie; 0 for a figure."""
        return max(round(self.seconds * self.rate), 2) if self.seconds else 0


@dataclass(frozen=True)
class Subject:
    """Labels and scale of a figure's images."""

    units: str = ""  # of the volume's scalars; empty if unknown
    scale: Scale | None = None  # of the scale bar
    line: tuple[Triple, ...] = ()  # one or two points that are measured, in fractions
    titles: Mapping[str, str] = field(default_factory=lambda: TITLES)  # of images, by name
    b: SceneInputs | None = None  # of the image of B
    wipe: float = 0.5  # share of the width that is A's where B wipes it
    view: View | None = None  # of the scale bar, a movie's first one; None for the image's own


def panels(choice: FigureChoice) -> list[QRect]:
    """Return where a figure's images are: side by side, left of the legend, above other colours."""
    gaps = 0 if choice.which == "wiped" else len(choice.names) - 1
    gap = max(round(GAP * choice.width), 1)
    own = choice.text * (BESIDE + BETWEEN * ({"reference", "b"} <= {*choice.names}))
    has_legend = choice.legend and choice.is_beside and choice.which != "difference"
    whole = choice.width - round(own) * has_legend
    width = (whole - gaps * gap) // (gaps + 1)
    lefts = [number * (whole - width) // max(gaps, 1) for number in range(gaps + 1)]
    below = round(BELOW * choice.text) if choice.is_beside and "difference" in choice.names else 0
    return [QRect(left, 0, width, choice.height - below) for left in lefts]


def figure(
    choice: FigureChoice,
    images: Mapping[str, tuple[Rgba, float]],
    inputs: SceneInputs,
    subject: Subject,
    compared: Comparison | None = None,
    reduced: Size | None = None,
) -> QImage:
    """Return a figure of images and brightness by name; raise RenderError for lack of memory.

    The difference is computed from the images unless it is given. A `reduced` figure is as large
    as that, and its marks are as much smaller.
    """
    names, titles, tfs = choice.names, dict(subject.titles), [inputs.transfer_function]
    if "difference" in names:
        compared = compared or Comparison.of(images)
        titles["difference"] = compared.name
    if "b" in names:
        # For a single image, its own.
        tfs = [*tfs, (subject.b or inputs).transfer_function][-len(names) :]
    last = [name for name in names if name != "difference"][-1:]
    # The difference is opaque; what is transparent is usually for paper.
    ground = WHITE if choice.background is None or is_bright(choice.background) else BLACK
    grounds = [ground if name == "difference" else choice.background for name in names]
    shown = [
        compared.picture(ground)
        if name == "difference" and compared is not None
        else compose(images[name][0], ground, images[name][1])
        for name, ground in zip(names, grounds, strict=True)
    ]
    if choice.which == "wiped":
        # One image has all marks.
        last, painter, at = [names[0]], QPainter(shown[0]), round(subject.wipe * shown[0].width())
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_Source)
        painter.drawImage(at, 0, shown.pop(), at, 0)
        painter.end()
    size, hint = reduced or (choice.width, choice.height), QPainter.RenderHint
    fits = len(shown) == 1 and shown[0].size() == QSize(*size)
    result = shown[0] if fits else empty_picture(*size, choice.background)
    painter = QPainter(result)
    painter.scale(size[0] / choice.width, size[1] / choice.height)
    painter.setRenderHints(hint.Antialiasing | hint.SmoothPixmapTransform)
    how = Qt.AspectRatioMode.IgnoreAspectRatio, Qt.TransformationMode.SmoothTransformation
    for name, image, background, place in zip(names, shown, grounds, panels(choice), strict=False):
        rect = centred(image.size().scaled(place.size(), Qt.AspectRatioMode.KeepAspectRatio), place)
        if image is not result:
            whole = painter.transform().mapRect(rect).size()
            painter.drawImage(rect, image.scaled(whole, *how))
        marks = Marks.over(painter, rect, choice.text, background)
        if marks is None:
            continue
        if len(names) > 1:
            marks.caption(titles[name])
        if choice.which == "wiped":
            marks.caption(titles["b"], subject.wipe)
        colors = marks
        if choice.is_beside:
            area = QRect(0, 0, choice.width, choice.height)
            area.setRight(place.right() if name == "difference" else area.right())
            colors = Marks(painter, area, choice.text, choice.background)
        if name == "difference" and compared is not None:
            colors.difference_bar(compared, background)
        elif choice.legend and name in last:
            colors.legend(legend_of(*tfs), subject.units)
        if choice.scale_bar and name == names[0] and subject.scale is not None:
            marks.scale_bar(subject.scale.bar(subject.view or inputs.view, inputs.part))
        marks.line(subject, inputs.view)
    painter.end()
    return result


LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of red, green and blue

HALF_STEP = 0.5 / 255  # colour up to which a pixel of an 8-bit image is black


@dataclass(frozen=True, eq=False)
class Comparison:
    """Comparison of two images (H, W, 3): a generator's and the truth, or, signed, B and A.

    The truth is usually finer: it is sampled at the centres of the generator's pixels. Means over
    them would count detail that no image of so few pixels can show.
    """

    drawn: Image
    truth: Image
    is_of_b: bool = False
    most: float | None = None  # difference at the last colour; None for one that suits the images

    @classmethod
    def of(cls, images: Mapping[str, tuple[Rgba, float]], most: float | None = None) -> Comparison:
        """Compare images of a figure by their names, in colours of 0..1 or 0..255."""
        name = "b" if "b" in images else "generator"
        drawn, truth = (_colors(images[each][0]) for each in (name, "reference"))
        return cls(drawn, truth, name == "b", most)

    def is_of(self, other: Comparison | None) -> bool:
        """Return whether the same images are compared in the same way."""
        if other is None or other.is_of_b != self.is_of_b:
            return False
        return other.drawn is self.drawn and other.truth is self.truth

    @property
    def measure(self) -> Shown:
        """Measure of the colours of the difference."""
        return "signed" if self.is_of_b else "change"

    @property
    def name(self) -> str:
        """Short name of the difference, for a caption."""
        return "B − A" if self.is_of_b else "Difference"

    @cached_property
    def _pair(self) -> tuple[Image, Image]:
        """The drawn image, and the other one at its pixels."""
        one, other = (np.clip(np.nan_to_num(image), 0, 1) for image in (self.drawn, self.truth))
        return one, np.clip(at_size_of(one, other, sampled=True), 0, 1)

    @cached_property
    def apart(self) -> NDArray[np.float64]:
        """Differences of the colours of each of the drawn image's pixels, (H, W, 3)."""
        one, other = self._pair
        return one.astype(np.float64) - other

    @cached_property
    def error(self) -> float:
        """Root mean square of the differences of the colours.

        Of B and A, only over pixels where either shows something: a mean over all pixels would
        depend on the background, and so on the pane's width.
        """
        squares = (self.apart**2).mean(axis=-1)
        if self.is_of_b:
            squares = squares[np.maximum(*self._pair).max(axis=-1) > HALF_STEP]
        return math.sqrt(squares.mean()) if squares.size else 0.0

    @cached_property
    def difference(self) -> NDArray[np.float64]:
        """Difference of each pixel (H, W): of luminance of B and A, else the RMS of its colours."""
        if self.is_of_b:
            return self.apart @ LUMINANCE
        return np.sqrt(np.mean(self.apart**2, axis=-1))

    @cached_property
    def scale(self) -> float:
        """Difference at the last colour."""
        return self.most or scale_of(self.difference, LEAST_DIFFERENCE)

    @cached_property
    def colored(self) -> NDArray[np.float64]:
        """The drawn image with the difference over it, (H, W, 3)."""
        return overlay(np.clip(self.drawn, 0, 1), self.difference, self.scale, self.measure)

    def picture(self, background: Background | None) -> QImage:
        """The difference over the drawn image: black for none, or white if the background is."""
        return picture_on(background, self.colored)

    def bar(self, background: Background | None) -> QImage:
        """A row of the colours of the difference."""
        return picture_on(background, color_bar(self.measure, SAMPLES)[None])

    @property
    def ends(self) -> tuple[str, str]:
        """Differences at the first and the last colour."""
        low = short(-self.scale) if self.measure == "signed" else "0"
        return low, short(self.scale, signed=self.measure == "signed")

    @property
    def title(self) -> str:
        """Meaning of the colours."""
        return (
            "luminance of B − A, over black" if self.is_of_b else "difference from the ground truth"
        )


def _colors(rgba: Rgba) -> Image:
    full = 255 if rgba.dtype == np.uint8 else 1
    return np.asarray(rgba[..., :3], np.float32) / np.float32(full)
