"""Figures: images as they are saved, with legend and scale bar, side by side or compared.

The window's figures and movies, and those of the command line, are made here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QImage, QPainter

from app.image_view.picture import Background, compose, paint_background
from app.window.image_marks import (
    paint_caption,
    paint_difference_bar,
    paint_legend,
    paint_scale_bar,
)
from model.errors import RenderError
from model.rendering.raster import at_size_of
from model.rendering.scale_bar import Scale
from model.scene.inputs import SceneInputs
from model.sensitivity.display import LEAST_DIFFERENCE, overlay, scale_of

Which = Literal["generator", "reference", "both", "difference"]
"""What a figure shows: one of both images, both side by side, or how far they are apart."""

TITLES = {"generator": "Generator", "reference": "Ground truth"}

GAP = 1 / 100
"""Distance of two images, relative to the figure's width."""

Image = NDArray[np.float32]
Rgba = Image | NDArray[np.uint8]
Size = tuple[int, int]


@dataclass(frozen=True)
class FigureLook:
    """Look of a figure; its size is in pixels.

    Attributes
    ----------
    background : tuple of int, "gradient" or None
        Red, green and blue, 0..255; None for a transparent one.
    """

    width: int
    height: int
    background: Background | None = (0, 0, 0)
    legend: bool = False
    scale_bar: bool = False


@dataclass(frozen=True)
class FigureChoice(FigureLook):
    """Choices for a figure or movie that is saved.

    Attributes
    ----------
    samples : int
        Of each pixel of a path-traced ground truth; 0 in other light.
    seconds : float
        Length of a movie of one full turn; 0 for a figure.
    rate : int
        Its frames a second.
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


def panels(look: FigureLook, which: Which) -> list[QRect]:
    """Return where the images of a figure are: one, or two side by side."""
    if which != "both":
        return [QRect(0, 0, look.width, look.height)]
    gap = max(round(GAP * look.width), 1)
    width = (look.width - gap) // 2
    return [QRect(0, 0, width, look.height), QRect(look.width - width, 0, width, look.height)]


def figure(
    look: FigureLook,
    images: Mapping[str, tuple[Rgba, float]],
    which: Which,
    inputs: SceneInputs,
    subject: Subject,
) -> QImage:
    """Return a figure.

    Parameters
    ----------
    images : mapping
        The image and its brightness, see :func:`app.image_view.picture.compose`, of "generator"
        or "reference", or of both. An image is enlarged to its panel, in its own proportions.

    Raises
    ------
    RenderError
        When there is not enough memory.
    """
    largest = 0.0
    if which == "difference":
        compared, largest = _difference(images)
        shown = [("", compared)]
    else:
        names = [*TITLES] if which == "both" else [which]
        shown = [
            (name, compose(images[name][0], look.background, images[name][1])) for name in names
        ]
    places = panels(look, which)
    if len(shown) == 1 and (shown[0][1].width(), shown[0][1].height()) == (look.width, look.height):
        result = shown[0][1]
    else:
        result = _empty(look)
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
        if which == "both":
            title = subject.title if name == "generator" else TITLES[name]
            paint_caption(painter, rect, title, look.background)
    background: Background | None = look.background
    if which == "difference":
        background = (0, 0, 0)
        title = difference_title(compared.width())
        paint_difference_bar(painter, rects[-1], largest, title, background)
    elif look.legend:
        paint_legend(painter, rects[-1], inputs.transfer_function, subject.units, background)
    if look.scale_bar and subject.scale is not None:
        bar = subject.scale.bar(inputs.view, inputs.crop)
        paint_scale_bar(painter, rects[0], bar, background)
    painter.end()
    return result


def pixels_of(image: QImage) -> NDArray[np.uint8]:
    """Return an opaque picture's pixels as uint8 (H, W, 3)."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    stored = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())
    pixels = stored[:, : 3 * rgb.width()].reshape(rgb.height(), rgb.width(), 3)
    return pixels.copy()


def difference_of(drawn: Image, truth: Image) -> NDArray[np.float64]:
    """Root mean squared difference of the colours of each of the generator's pixels: (S, S).

    The truth is mostly finer: what it shows in the middle of a pixel of the generator's (S, S, 3)
    is compared. Means would count what any image of so few pixels lacks.
    """
    # Not by model.metrics: it imports torch and more, without which the window starts.
    one, other = (np.clip(np.nan_to_num(image), 0, 1) for image in (drawn, truth))
    sampled = np.clip(at_size_of(one, other, sampled=True), 0, 1)
    return np.sqrt(np.mean((one.astype(np.float64) - sampled) ** 2, axis=-1))


def in_colors(drawn: Image, difference: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return an image with a difference over it, (S, S, 3), and the value of the last colour."""
    scale = scale_of(difference, LEAST_DIFFERENCE)
    return overlay(drawn, difference, scale, "change"), scale


def difference_title(pixels: int) -> str:
    """Say what the colours of a difference of images of so many pixels a side are."""
    return f"difference from the ground truth at {pixels} × {pixels} pixels"


def _difference(images: Mapping[str, tuple[Rgba, float]]) -> tuple[QImage, float]:
    """Return the generator's image with its difference from the reference's over it."""
    drawn, truth = (np.asarray(images[name][0][..., :3], np.float32) for name in TITLES)
    colored, largest = in_colors(np.clip(drawn, 0, 1), difference_of(drawn, truth))
    opaque = np.ones((*colored.shape[:2], 4), np.float32)
    opaque[..., :3] = colored
    return compose(opaque, (0, 0, 0)), largest


def _fitted(image: QImage, place: QRect) -> QRect:
    """Return the largest rectangle of an image's proportions in the middle of a place."""
    size = image.size().scaled(place.size(), Qt.AspectRatioMode.KeepAspectRatio)
    rect = QRect(0, 0, size.width(), size.height())
    rect.moveCenter(place.center())
    return rect


def _empty(look: FigureLook) -> QImage:
    formats = QImage.Format
    kind = (
        formats.Format_RGBA8888_Premultiplied if look.background is None else formats.Format_RGB888
    )
    image = QImage(look.width, look.height, kind)
    if image.isNull():
        raise RenderError(
            f"A picture of {look.width} x {look.height} pixels does not fit into the memory; "
            "choose a smaller one."
        )
    if look.background is None:
        image.fill(Qt.GlobalColor.transparent)
    else:
        painter = QPainter(image)
        paint_background(painter, image.rect(), look.background)
        painter.end()
    return image
