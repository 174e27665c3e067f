"""A text button: a title, a detail about its present state, and a menu."""

from typing import Literal

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QFontMetrics, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QMenu, QSizePolicy, QToolButton

from app import theme
from app.controls import Painted, show_tips

Tone = Literal["dim", "change", "attention", "error"]  # usual, under way, noticeable, wrong

HEIGHT = 24
PADDING, GAP = 8, 7
ARROW = 7  # width of the arrow that says that there is a menu, in pixels
GROUND_OPACITY = 215  # opacity of the background over an image, of 255


class CaptionButton(QToolButton):
    """Shows a title and a detail in one line; a click opens its menu.

    Its natural width fits both. With less room, the detail is shortened first, then the middle of
    the title. Over an image it is dark in both themes.
    """

    title = Painted("", "_follow")
    detail = Painted("", "_follow")
    tone = Painted[Tone]("dim")  # colour of the detail
    is_folded = Painted(False, "_follow")  # whether the detail is hidden

    def __init__(self, on_image: bool = False) -> None:
        super().__init__()
        self._on_image = on_image
        self.titles: tuple[str, ...] = ()  # titles for which there is always room
        self.setFixedHeight(HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)

    def add_menu(self) -> QMenu:
        """Set its menu and return it."""
        menu = QMenu(self)
        show_tips(menu)
        self.setMenu(menu)
        return menu

    def set_menu(self, menu: QMenu | None) -> None:
        """Set the menu that a click opens; None for no menu."""
        if menu is not self.menu():
            self.setMenu(menu)  # type: ignore[arg-type]
            self.updateGeometry()
            self.update()

    def sizeHint(self) -> QSize:
        """Return the size of the whole text."""
        width = 2 * PADDING + max(self._width_of(each, True) for each in (self.title, *self.titles))
        if self.detail and not self.is_folded:
            width += GAP + self._width_of(self.detail)
        if self.menu() is not None:
            width += GAP + ARROW
        return QSize(width, HEIGHT)

    def minimumSizeHint(self) -> QSize:
        """Return the size of a few letters of the title."""
        return QSize(min(self.sizeHint().width(), 64), HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint background, title, detail and arrow."""
        colors = theme.ON_IMAGE if self._on_image else theme.present()
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        ground = QColor(colors.window if self._on_image else colors.panel)
        if self.underMouse() or self.isDown():
            ground = QColor(colors.field)
        elif self._on_image:
            ground.setAlpha(GROUND_OPACITY)
        else:
            ground.setAlpha(0)
        painter.setBrush(ground)
        if self.hasFocus():
            painter.setPen(QPen(QColor(colors.change), 2))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), 4, 4)
        right = self.width() - PADDING
        if self.menu() is not None:
            self._paint_arrow(painter, QColor(colors.dim), right - ARROW)
            right -= ARROW + GAP
        self._paint_words(painter, colors, right)

    def _paint_words(self, painter: QPainter, colors: theme.Colors, right: int) -> None:
        left, height = PADDING, self.height()
        flags = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft
        enabled = self.isEnabled()
        font = self._font(bold=True)
        metrics = QFontMetrics(font)
        title = metrics.elidedText(self.title, Qt.TextElideMode.ElideMiddle, max(right - left, 0))
        painter.setFont(font)
        painter.setPen(QColor(colors.text if enabled else colors.disabled))
        painter.drawText(QRectF(left, 0, right - left, height), flags, title)
        left += metrics.horizontalAdvance(title) + GAP
        if not self.detail or self.is_folded or right - left < 20:
            return
        font, end = self._font(), Qt.TextElideMode.ElideRight
        detail = QFontMetrics(font).elidedText(self.detail, end, right - left)
        painter.setFont(font)
        painter.setPen(QColor(getattr(colors, self.tone)))
        painter.drawText(QRectF(left, 0, right - left, height), flags, detail)

    def _paint_arrow(self, painter: QPainter, color: QColor, left: int) -> None:
        top, tip = self.height() / 2 - 2, self.height() / 2 + 2.5
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(color)
        corners = (left, top), (left + ARROW, top), (left + ARROW / 2, tip)
        painter.drawPolygon([QPointF(x, y) for x, y in corners])

    def _follow(self) -> None:
        self.setAccessibleName(", ".join(filter(None, (self.title, self.detail))))
        self.updateGeometry()
        self.update()

    def _font(self, bold: bool = False) -> QFont:
        font = QFont(self.font())
        font.setPixelSize(theme.SMALL_PIXELS if self._on_image else theme.TEXT_PIXELS)
        if bold:
            font.setWeight(QFont.Weight.DemiBold)
        return font

    def _width_of(self, text: str, bold: bool = False) -> int:
        # One pixel more, because Qt cuts off a text that just fits.
        return QFontMetrics(self._font(bold)).horizontalAdvance(text) + 1
