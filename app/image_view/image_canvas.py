"""A widget that paints one image, messages over it, and a ring for keyboard focus."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QImage, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app import theme
from app.controls import BY_KEYS, Painted
from app.picture import BLACK, Background, brighten_clear, is_bright, paint_background
from model.rendering.brightness import brighten
from model.rendering.raster import Raster
from model.scene.region import Reach
from model.sensitivity.display import on_white


class KeyedWidget(QWidget):
    """A widget that paints a ring around itself if the keyboard has moved the focus to it."""

    _is_ringed = Painted(False)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show a ring if the keyboard has moved the focus here."""
        self._is_ringed = event.reason() in BY_KEYS
        super().focusInEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Hide the ring."""
        self._is_ringed = False
        super().focusOutEvent(event)

    def _paint_ring(self, painter: QPainter) -> None:
        """Paint the ring, if there is one; call it last."""
        if self._is_ringed:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(theme.ON_IMAGE.change), 2))
            painter.drawRect(self.rect().adjusted(1, 1, -1, -1))


_MARGIN = 14

PROGRESS_HEIGHT = 2  # of the line that shows an image's progress, in pixels
LEAST_PROGRESS = 0.06  # least part of that line, painted as soon as an image is begun
Decoration = Callable[[QPainter, QRect], None]  # paints over an image's rectangle


def paint_progress(painter: QPainter, rect: QRect, progress: float) -> None:
    """Paint a progress line along the upper edge of a rectangle."""
    done = round(progress * rect.width())
    line = QRect(rect.left(), rect.top(), done, PROGRESS_HEIGHT)
    painter.fillRect(line, QColor(theme.ON_IMAGE.change))


def paint_plate(painter: QPainter, box: QRectF, color: str, opacity: int) -> None:
    """Paint the background of a text over an image, given its opacity of 255."""
    ground = QColor(color)
    ground.setAlpha(opacity)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(ground)
    painter.drawRoundedRect(box, 3, 3)


def picture_on(background: Background | None, colors: NDArray[np.float64]) -> QImage:
    """Convert a picture of a difference (H, W, 3): it is white for none if the background is."""
    return to_qimage(on_white(colors) if is_bright(background) else colors)


def to_qimage(
    rgba: NDArray[np.floating], brightness: float = 1.0, *, clear: bool = False
) -> QImage:
    """Convert premultiplied colours (H, W, 4), or opaque ones (H, W, 3), to an image.

    It is on black, or transparent. Values outside [0, 1] are clipped, and NaN pixels are dark. See
    :func:`model.rendering.brightness.brighten`.
    """
    levels = np.ascontiguousarray(rgba, np.float32)
    if levels.shape[2] == 3:
        # Painted over something transparent, Qt takes the unused number for an opacity.
        levels = np.pad(levels, ((0, 0), (0, 0), (0, 1)), constant_values=1)
    if clear or brightness != 1:
        levels = np.clip(levels, 0, 1)
        if clear:
            brighten_clear(levels, brightness)
        else:
            brighten(levels[..., :3], brightness)
    formats = QImage.Format
    # The second is the format in which Qt enlarges images fastest.
    given, shown = formats.Format_RGBX32FPx4, formats.Format_RGB32
    if clear:
        given = formats.Format_RGBA32FPx4_Premultiplied
        shown = formats.Format_ARGB32_Premultiplied
    height, width = levels.shape[:2]
    return QImage(levels.data, width, height, given).convertToFormat(shown)


class ImageCanvas(KeyedWidget):
    """Shows an image as large as possible, with a message and its progress.

    A message dims the image instead of replacing it, so that the last image stays visible. A cover
    replaces the image while it is set; decorations are painted over both.

    An image may be wider or higher than the square in its middle, which all images share.
    Decorations, places and square covers refer to that square.
    """

    resized = Signal()  # when the number of pixels on the screen has changed
    background = Painted[Background](BLACK)
    cover = Painted[QImage | None](None)  # in the image's place
    wiped = Painted["tuple[ImageCanvas, int] | None"](None)  # right part: whose, from where
    gave_focus = False  # whether the last press has moved the focus here from the other of A and B
    is_edited = Painted[bool](False)  # whether a frame shows that the TF editor edits its TF
    progress = Painted[float | None](None)  # progress of the image, 0..1; None if it is complete
    below_message = Painted[QWidget | None](None)  # messages are above it, not in the middle

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
        self.setCursor(Qt.CursorShape.OpenHandCursor)
        # Otherwise Qt would paint what is below it first.
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.image: QImage | None = None
        self.message = ""
        self._message_color = theme.ON_IMAGE.dim
        self.decorations: list[Decoration] = []  # painted over the image whenever it is

    @property
    def image_rect(self) -> QRect:
        """Square in the middle of the image, which images of all proportions share."""
        whole = self.picture_rect
        side = min(whole.width(), whole.height())
        return centred(QSize(side, side), whole)

    @property
    def reach(self) -> Reach:
        """The whole image's reach, see :data:`model.scene.region.Reach`."""
        whole = self.picture_rect
        return Raster(max(whole.width(), 1), max(whole.height(), 1)).reach

    @property
    def picture_rect(self) -> QRect:
        """Place of the image, whose square is as large as can be; the canvas without an image.

        An image from before the canvas became narrower reaches beyond it, and moves nothing.
        """
        return self.rect_of(self.image)

    def rect_of(self, image: QImage | None) -> QRect:
        """Place of an image whose square lies where that of all images does."""
        if image is None or image.isNull():
            return self.rect()
        size, side = image.size(), min(self.width(), self.height())
        return centred(size * (side / min(size.width(), size.height())), self.rect())

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of the canvas in pixels of the screen."""
        ratio = self.devicePixelRatioF()
        return round(self.width() * ratio), round(self.height() * ratio)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Emit that the canvas has another size in pixels."""
        super().resizeEvent(event)
        self.resized.emit()

    def place_of(self, position: QPointF) -> tuple[float, float]:
        """Return a position as fractions of the square in the middle, to the right and down."""
        rect = self.image_rect
        return (
            (position.x() - rect.left()) / max(rect.width(), 1),
            (position.y() - rect.top()) / max(rect.height(), 1),
        )

    def has_place(self, place: tuple[float, float]) -> bool:
        """Return whether a place, see :meth:`place_of`, is in the image."""
        return all(abs(p - 0.5) < half for p, half in zip(place, self.reach, strict=True))

    def show_image(self, image: QImage | None) -> None:
        """Show an image, or none, and remove the message."""
        self.message = ""
        self.replace_image(image)

    def replace_image(self, image: QImage | None) -> None:
        """Replace the image; a message over it stays."""
        self.image = image
        self.update()

    def show_message(self, text: str, color: str = theme.ON_IMAGE.dim) -> None:
        """Show a message over the image."""
        self.message = text
        self._message_color = color
        self.update()

    def sizeHint(self) -> QSize:
        """Return a size at which the whole window fits on a laptop's screen."""
        return QSize(480, 420)

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size."""
        return QSize(160, 160)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the image, then the texts."""
        painter = QPainter(self)
        painter.setRenderHints(
            QPainter.RenderHint.SmoothPixmapTransform | QPainter.RenderHint.Antialiasing
        )
        rect, square = self.picture_rect, self.image_rect
        is_opaque = self.image is not None and not (self.message or self.image.hasAlphaChannel())
        hides_all = is_opaque and self.cover is None and rect.contains(self.rect())
        if not hides_all:
            paint_background(painter, self.rect(), self.background)
        if self.image is not None:
            painter.setOpacity(0.3 if self.message else 1.0)
            self._paint_picture(painter, self)
            if self.wiped is not None:
                self._paint_wiped(painter, *self.wiped)
            painter.setOpacity(1.0)
            if rect.width() == rect.height() and rect.size() != self.size():
                # The volume may be cut off at a model's square: its edge must be visible.
                painter.setPen(QPen(QColor(theme.ON_IMAGE.line), 1))
                painter.drawRect(rect)
            if not self.message:
                for paint in self.decorations:
                    painter.save()
                    paint(painter, square)
                    painter.restore()
            if self.wiped is not None:
                at = self.wiped[1]
                for color, width in ((theme.ON_IMAGE.window, 3), (theme.ON_IMAGE.text, 1)):
                    painter.setPen(QPen(QColor(color), width))
                    painter.drawLine(at, 0, at, self.height())
        if self.message:
            self._paint_message(painter, self, self.rect())
        if self.progress is not None:
            paint_progress(painter, self.rect(), self.progress)
        if self.is_edited:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(theme.ON_IMAGE.change), 1))
            painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        self._paint_ring(painter)

    def _paint_picture(self, painter: QPainter, of: ImageCanvas) -> None:
        """Paint a canvas's cover or image here; its image may have other proportions, as before."""
        picture = of.cover or of.image
        if picture is not None:
            painter.drawImage(self.rect_of(picture), picture)

    def _paint_wiped(self, painter: QPainter, other: ImageCanvas, at: int) -> None:
        """Paint another canvas's picture to the right of a line."""
        painter.save()
        place = self.rect().adjusted(at, 0, 0, 0)
        painter.setClipRect(place)
        paint_background(painter, self.rect(), self.background)
        self._paint_picture(painter, other)
        if not self.message:
            self._paint_message(painter, other, place)
        painter.restore()

    def _paint_message(self, painter: QPainter, of: ImageCanvas, place: QRect) -> None:
        # Narrower than the canvas, because long lines are hard to read.
        side = _MARGIN + (place.width() - 2 * _MARGIN) // 10
        column = place.adjusted(side, _MARGIN, -side, -_MARGIN)
        flags = Qt.AlignmentFlag.AlignCenter
        if self.below_message is not None:
            column.setBottom(self.below_message.y() - _MARGIN)
            flags = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom
        flags |= Qt.TextFlag.TextWordWrap
        # Backgrounds and images may be as bright as the text.
        plate = painter.boundingRect(column, flags, of.message).adjusted(-6, -3, 6, 3)
        if of.message:
            painter.fillRect(plate, QColor(theme.ON_IMAGE.window))
        painter.setPen(QColor(of._message_color))
        painter.drawText(column, flags, of.message)


def centred(size: QSize, whole: QRect) -> QRect:
    """Return a rectangle of a size in the middle of another."""
    rect = QRect(QPoint(), size)
    rect.moveCenter(whole.center())
    return rect
