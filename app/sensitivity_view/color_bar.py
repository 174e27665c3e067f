"""The colour bar of a field over its image, which a click locks."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, QObject, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QToolButton

from app import theme
from app.image_view.image_canvas import ImageCanvas
from app.state.sensitivity_state import SensitivityState
from model.sensitivity.display import Shown, color_bar

BAR, HEIGHT, MARGIN = QSize(140, 10), 24, 8

BACKING = 190
"""Opacity of what lies behind the text, of 255."""

ROOM = 60
"""Height of the lines above a painted bar, at most, in pixels."""

LOCKED = "locked"
TIP = "Click to keep the scale of colours and curve, to compare"


class ColorBar(QToolButton):
    """Says what the colours over an image mean; a click locks their scale, and frees it again."""

    def __init__(self, canvas: ImageCanvas, sensitivity: SensitivityState) -> None:
        super().__init__(canvas)
        self._canvas, self._sensitivity = canvas, sensitivity
        self._bar = QImage()
        self._texts = ("", "", "")
        font = self.font()
        font.setPixelSize(theme.SMALL_PIXELS)
        self.setFont(font)
        self.setFixedHeight(HEIGHT)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        # After a click, keys such as W are the window's again.
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.clicked.connect(self._toggle_lock)
        canvas.installEventFilter(self)
        self.hide()

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Stay at the middle of the lower edge."""
        if event.type() == QEvent.Type.Resize:
            self.place()
        return False

    @property
    def said(self) -> str:
        """What the bar says, from its left end on; empty while it is hidden."""
        low, high, meaning = self._texts
        return "" if self.isHidden() else f"{low} to {high} {meaning}"

    def show_scale(self, measure: Shown, texts: tuple[str, str, str], tip: str) -> None:
        """Show a scale."""
        self._bar = _shades(measure)
        self._texts = texts
        self.setToolTip(f"{tip}\n{TIP}")
        self.setAccessibleName(f"Colours: {texts[0]} to {texts[1]} {texts[2]}")
        self.place()
        self.show()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint lower end, bar, upper end and meaning."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colors = theme.ON_IMAGE
        painter.setPen(QColor(colors.change if self.hasFocus() else colors.line))
        painter.setBrush(QColor(colors.panel))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 4, 4)
        x = float(MARGIN)
        low, high, meaning = self._texts
        for text, color in (
            (low, colors.dim), (None, ""), (high, colors.text), (meaning, colors.dim),
            (self._lock, colors.change),
        ):  # fmt: skip
            if text is None:
                box = QRectF(x, (HEIGHT - BAR.height()) / 2, self._bar_width, BAR.height())
                painter.drawImage(box, self._bar)
                x += self._bar_width + MARGIN
                continue
            painter.setPen(QColor(color))
            wide = self._width_of(text)
            flags = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft
            painter.drawText(QRectF(x, 0, wide + 2, HEIGHT), flags, text)
            x += wide + MARGIN

    @property
    def _bar_width(self) -> float:
        """Narrower in a narrow image."""
        return min(BAR.width(), max(self._canvas.width() / 4, 30))

    def _width_of(self, text: str) -> float:
        return QFontMetricsF(self.font()).horizontalAdvance(text)

    def place(self) -> None:
        """Lie in the middle of the lower edge, as wide as the text."""
        texts = (*self._texts, self._lock)
        width = round(sum(self._width_of(text) + MARGIN for text in texts) + self._bar_width)
        self.setFixedWidth(min(width + 2 * MARGIN, max(self._canvas.width() - 2 * MARGIN, 40)))
        # Over the scale bar's and the legend's corners it is not.
        at = self._canvas.width() // 2 - self.width() // 2
        self.move(at, self._canvas.height() - HEIGHT - MARGIN)
        self.update()

    @property
    def _lock(self) -> str:
        return LOCKED if self._sensitivity.choices.locked else ""

    def _toggle_lock(self) -> None:
        self._sensitivity.choose(locked=not self._sensitivity.choices.locked)


def paint_bar(
    painter: QPainter,
    rect: QRect,
    right: int,
    measure: Shown,
    text: str,
) -> None:
    """Paint a colour bar into the lower left corner of an image.

    Parameters
    ----------
    rect : QRect
        The image.
    right : int
        Where the text has to end.
    measure : {"change", "signed", "visible"}
        Whose colours it has.
    text : str
        Says above the bar what its ends are; in two lines where one is too long.
    """
    bar = _shades(measure)
    x, y = rect.left() + MARGIN, rect.bottom() - MARGIN - BAR.height()
    painter.drawImage(QRectF(x, y, BAR.width(), BAR.height()), bar)
    painter.setPen(QPen(QColor(theme.ON_IMAGE.dim), 1))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(QRectF(x, y, BAR.width(), BAR.height()))
    flags = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap
    room = QRectF(x, y - 4 - ROOM, right - MARGIN - x, ROOM)
    # Images may be bright there.
    ground = QColor(theme.ON_IMAGE.field)
    ground.setAlpha(BACKING)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(ground)
    painter.drawRoundedRect(painter.boundingRect(room, flags, text).adjusted(-4, -2, 4, 2), 3, 3)
    painter.setPen(QColor(theme.ON_IMAGE.text))
    painter.drawText(room, flags, text)


def _shades(measure: Shown) -> QImage:
    """Return a bar's colours as a picture of one row."""
    width = BAR.width()
    colors = np.ascontiguousarray(np.rint(255 * color_bar(measure, width)).astype(np.uint8)[None])
    return QImage(colors.data, width, 1, 3 * width, QImage.Format.Format_RGB888).copy()
