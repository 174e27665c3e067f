"""Icons of controls, drawn as lines in the text's colour, and the buttons that have one."""

from __future__ import annotations

from functools import cache

from PySide6.QtCore import QByteArray, QEvent, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QToolButton

from app import theme

SIDE = 18
"""Of an icon, in pixels."""

BUTTON = 28
"""Side of a button that has an icon alone, in pixels."""

RATIOS = 1, 2, 3
"""Pixels of the screen to one of the window that an icon is drawn for."""

_SHAPES = {
    "rectangle": '<rect x="3" y="4.5" width="12" height="9" rx="1" stroke-dasharray="2.6 1.6"/>',
    "lasso": '<path d="M9 3.2c3.6 0 6.2 1.8 6.2 4.2s-2.6 4.2-6.2 4.2-6.2-1.8-6.2-4.2S5.4 3.2 9 3.2z'
    'M6 11.2c-1.6.5-1.7 2.2-.4 2.5 1.4.3 1.6-1 .6-1.9M5.5 13.6c.2 1 0 1.5-.5 1.9"/>',
    "crop": '<path d="M5 1.5v11.5h11.5M1.5 5H13v11.5"/>',
    "compare": '<rect x="2.5" y="3.5" width="13" height="11" rx="1"/><path d="M9 3.5v11"/>',
    "difference": '<rect x="2.5" y="3.5" width="13" height="11" rx="1"/>'
    '<path d="M9 5.3v4M7 7.3h4M7 12h4"/>',
    "browse": '<g stroke="none" fill="INK"><circle cx="5" cy="5" r="1.5"/>'
    '<circle cx="10" cy="3.8" r="1.3"/><circle cx="13.8" cy="7.8" r="1.6"/>'
    '<circle cx="8.6" cy="9.2" r="1.5"/><circle cx="4" cy="11" r="1.3"/>'
    '<circle cx="12" cy="13.4" r="1.5"/><circle cx="7" cy="14.4" r="1.2"/></g>',
    "camera": '<path d="M3 5.5h2.6l1.2-1.8h4.4l1.2 1.8H15a1 1 0 0 1 1 1v7a1 1 0 0 1-1 1H3'
    'a1 1 0 0 1-1-1v-7a1 1 0 0 1 1-1z"/><circle cx="9" cy="9.8" r="2.6"/>',
    "menu": '<path d="M3 5h12M3 9h12M3 13h12"/>',
    "more": '<g stroke="none" fill="INK"><circle cx="4" cy="9" r="1.4"/>'
    '<circle cx="9" cy="9" r="1.4"/><circle cx="14" cy="9" r="1.4"/></g>',
    "plus": '<path d="M9 3.5v11M3.5 9h11"/>',
    "close": '<path d="M4.5 4.5l9 9M13.5 4.5l-9 9"/>',
    "rename": '<path d="M3.5 14.5l.8-3.3 7.7-7.7 2.5 2.5-7.7 7.7z"/>',
    "delete": '<path d="M3.5 5h11M7 5V3.3h4V5M5 5l.7 9.7h6.6L13 5M7.6 7.5v5M10.4 7.5v5"/>',
    "panel": '<rect x="2.5" y="3.5" width="13" height="11" rx="1"/>'
    '<path d="M10.8 3.5v11M12.4 6h1.6M12.4 8.3h1.6"/>',
    "eye": '<path d="M1.8 9S4.5 4.5 9 4.5 16.2 9 16.2 9 13.5 13.5 9 13.5 1.8 9 1.8 9z"/>'
    '<circle cx="9" cy="9" r="2.2"/>',
    "home": '<path d="M2.8 9L9 3.3 15.2 9M4.6 7.6v7h3.2v-4h2.4v4h3.2v-7"/>',
}
"""Drawings by name, on a square of 18 by 18."""


def icon_names() -> list[str]:
    """Return the names of all icons."""
    return list(_SHAPES)


@cache
def _drawing(name: str, ink: str) -> QSvgRenderer:
    shape = _SHAPES[name].replace("INK", ink)
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIDE} {SIDE}">'
        f'<g fill="none" stroke="{ink}" stroke-width="1.4" stroke-linejoin="round" '
        f'stroke-linecap="round">{shape}</g></svg>'
    )
    return QSvgRenderer(QByteArray(svg.encode()))


def icon(name: str, colors: theme.Colors | None = None) -> QIcon:
    """Return an icon by its name, in the text's colour of a theme or of the one in use."""
    colors = colors or theme.present()
    found = QIcon()
    for mode, ink in ((QIcon.Mode.Normal, colors.text), (QIcon.Mode.Disabled, colors.disabled)):
        for ratio in RATIOS:
            picture = QPixmap(SIDE * ratio, SIDE * ratio)
            picture.fill(Qt.GlobalColor.transparent)
            painter = QPainter(picture)
            _drawing(name, QColor(ink).name()).render(
                painter, QRectF(0, 0, SIDE * ratio, SIDE * ratio)
            )
            painter.end()
            picture.setDevicePixelRatio(ratio)
            found.addPixmap(picture, mode)
    return found


class IconButton(QToolButton):
    """A button with an icon, and maybe a text; its tooltip says its name and key, then a tip.

    Its colours are those of a fixed theme, or of the one in use.
    """

    def __init__(
        self,
        shape: str,
        name: str,
        key: str = "",
        tip: str = "",
        text: str = "",
        colors: theme.Colors | None = None,
    ) -> None:
        super().__init__()
        self._shape, self._colors = shape, colors
        self.setProperty("role", "flat")
        self.setIconSize(QSize(SIDE, SIDE))
        self.setAccessibleName(name)
        first = f"{name} ({key})" if key else name
        self.setToolTip(f"{first}\n{tip}" if tip else first)
        # After a click, keys such as W are the window's again.
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.set_caption(text)
        self._draw()

    def set_caption(self, text: str) -> None:
        """Show a text next to the icon, or the icon alone."""
        self.setText(text)
        style = Qt.ToolButtonStyle
        self.setToolButtonStyle(
            style.ToolButtonTextBesideIcon if text else style.ToolButtonIconOnly
        )
        self.setFixedHeight(BUTTON)
        if text:
            # As wide as its words: a least width of its own would be less.
            self.setMinimumWidth(0)
            self.setMaximumWidth(16777215)
        else:
            self.setFixedWidth(BUTTON)

    def minimumSizeHint(self) -> QSize:
        """Return the room of the icon, of which a style that adds some for an arrow takes none."""
        return super().minimumSizeHint().boundedTo(self.maximumSize())

    def changeEvent(self, event: QEvent) -> None:
        """Draw the icon anew in another theme."""
        if event.type() == QEvent.Type.PaletteChange and self._colors is None:
            self._draw()
        super().changeEvent(event)

    def _draw(self) -> None:
        self.setIcon(icon(self._shape, self._colors))
