"""Icons of controls, drawn as lines in the text's colour, and the buttons that have one."""

from functools import cache
from pathlib import Path

from PySide6.QtCore import QByteArray, QEvent, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QToolButton

from app import theme

SIDE = 18  # of an icon, in pixels
BUTTON = 28  # side of a button that has an icon alone, in pixels
RATIOS = 1, 2, 3  # screen pixels per window pixel for which icons are drawn
FOLDER = Path(__file__).parent.parent / "resources" / "icons"  # drawings, 18 by 18


@cache
def _drawing(name: str, ink: str) -> QSvgRenderer:
    svg = (FOLDER / f"{name}.svg").read_text("utf-8").replace("currentColor", ink)
    return QSvgRenderer(QByteArray(svg.encode()))


def icon(name: str, colors: theme.Colors | None = None) -> QIcon:
    """Return an icon by its name, in the text's colour of a theme or of the one in use."""
    colors = colors or theme.present()
    found = QIcon()
    for mode, ink in ((QIcon.Mode.Normal, colors.text), (QIcon.Mode.Disabled, colors.disabled)):
        for ratio in RATIOS:
            side = SIDE * ratio
            picture = QPixmap(side, side)
            picture.fill(Qt.GlobalColor.transparent)
            painter = QPainter(picture)
            _drawing(name, QColor(ink).name()).render(painter, QRectF(0, 0, side, side))
            painter.end()
            picture.setDevicePixelRatio(ratio)
            found.addPixmap(picture, mode)
    return found


class IconButton(QToolButton):
    """A button with an icon, and maybe a text; its tooltip says its name and key, then a tip."""

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
        self.set_caption(text)
        self._draw()

    def set_caption(self, text: str) -> None:
        """Show a text next to the icon, or the icon alone."""
        self.setText(text)
        of = Qt.ToolButtonStyle
        self.setToolButtonStyle(of.ToolButtonTextBesideIcon if text else of.ToolButtonIconOnly)
        self.setFixedHeight(BUTTON)
        if text:
            # As wide as its text; Qt's minimum width is smaller.
            self.setMinimumWidth(0)
            self.setMaximumWidth(16777215)
        else:
            self.setFixedWidth(BUTTON)

    def minimumSizeHint(self) -> QSize:
        """Return the size of the icon; some styles would add room for an arrow."""
        return super().minimumSizeHint().boundedTo(self.maximumSize())

    def changeEvent(self, event: QEvent) -> None:
        """Draw the icon again in another theme."""
        if event.type() == QEvent.Type.PaletteChange and self._colors is None:
            self._draw()
        super().changeEvent(event)

    def _draw(self) -> None:
        self.setIcon(icon(self._shape, self._colors))
