"""The window's dark and light colours, and its style sheet.

A role in capitals, such as `TEXT`, is its colour in the current theme: look it up when painting,
and renew stored pens on `QEvent.PaletteChange`. Widgets over an image are dark in both themes and
use :data:`ON_IMAGE`.
"""

from dataclasses import asdict, astuple, dataclass
from pathlib import Path
from string import Template

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication

from app.state.settings import ThemeChoice


@dataclass(frozen=True)
class Colors:
    """Colours of one theme by their roles, as "#rrggbb"; the defaults are both themes', dark first.

    Each colour has one meaning: `visible` is what is seen now, `change` what an edit would change
    (and the accent of controls), `attention` what needs notice or is elsewhere.
    """

    window: str = "#17181a #c6c8ca"
    panel: str = "#1f2022 #cfd1d3"
    field: str = "#2a2b2e #dddfe0"
    plot: str = "#151617 #d8dadb"
    voxels: str = "#3a3c40 #b4b7ba"
    pressed: str = "#1d3f55 #a8cbe2"
    line: str = "#3a3c40 #a2a5a9"
    text: str = "#dcdddf #16181a"
    dim: str = "#a4a7ac #3d4045"
    disabled: str = "#6f7278 #64676c"
    curve: str = "#f0f0f0 #1b1d1f"
    change: str = "#56b4e9 #074f7d"
    visible: str = "#2fb890 #005c43"
    attention: str = "#e6a532 #6b4500"
    error: str = "#ef8a62 #8f2f0a"


DARK, LIGHT = (Colors(*(pair.split()[n] for pair in astuple(Colors()))) for n in (0, 1))

ON_IMAGE = DARK  # colours over an image, which is black in both themes

STYLE = Path(__file__).parent.parent / "resources" / "window.qss"

CANVAS = "#000000"

TEXT_PIXELS, SMALL_PIXELS = 13, 12  # height of text; that of captions, chips and the status line

_used = DARK


def __getattr__(name: str) -> str:
    if not name.isupper():
        raise AttributeError(name)
    return str(getattr(_used, name.lower()))


def present() -> Colors:
    """Return the colours of the current theme."""
    return _used


def apply_theme(application: QApplication, wanted: ThemeChoice = "system") -> None:
    """Apply a theme to an application; the system's is dark if it is unknown."""
    scheme = application.styleHints().colorScheme()
    is_light = wanted == "light" or (wanted == "system" and scheme is Qt.ColorScheme.Light)
    global _used
    _used = colors = LIGHT if is_light else DARK
    application.setStyle("Fusion")
    font = application.font()
    font.setPixelSize(TEXT_PIXELS)
    application.setFont(font)
    application.setPalette(palette_of(colors))
    names = asdict(colors) | {f"image_{role}": ink for role, ink in asdict(ON_IMAGE).items()}
    sheet = Template(STYLE.read_text("utf-8")).substitute(names, small=SMALL_PIXELS)
    application.setStyleSheet(sheet)


def palette_of(colors: Colors) -> QPalette:
    """Return Qt's palette of a theme."""
    role = QPalette.ColorRole
    palette = QPalette()
    for roles, color in (
        ((role.Window, role.Button, role.AlternateBase), colors.window),
        ((role.Base, role.ToolTipBase), colors.panel),
        ((role.WindowText, role.Text, role.ButtonText, role.ToolTipText), colors.text),
        ((role.PlaceholderText,), colors.dim),
        ((role.Highlight, role.Link), colors.change),
        ((role.HighlightedText,), colors.window),
        ((role.Mid, role.Dark), colors.line),
    ):
        for each in roles:
            palette.setColor(each, QColor(color))
    for each in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, each, QColor(colors.disabled))
    return palette
