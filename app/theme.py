"""The window's colours, dark and light, and its style sheet.

The names in capitals are the colours of the theme that is in use: take them when you
paint, and renew a pen that you keep on `QEvent.PaletteChange`. What lies over an image is dark in
both themes, and takes its colours from :data:`ON_IMAGE`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from string import Template

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication

from app.state.settings import ThemeChoice


@dataclass(frozen=True)
class Colors:
    """Colours of one theme by their roles, as "#rrggbb".

    One colour has one meaning: `visible` is what is seen now, `change` what an edit would change
    (and the accent of controls), `attention` what is elsewhere, or is to be noticed.
    """

    window: str
    panel: str
    field: str
    plot: str
    voxels: str
    pressed: str
    line: str
    text: str
    dim: str
    disabled: str
    curve: str
    change: str
    visible: str
    attention: str
    error: str


DARK = Colors(
    window="#17181a",
    panel="#1f2022",
    field="#2a2b2e",
    plot="#151617",
    voxels="#3a3c40",
    pressed="#1d3f55",
    line="#3a3c40",
    text="#dcdddf",
    dim="#a4a7ac",
    disabled="#6f7278",
    curve="#f0f0f0",
    change="#56b4e9",
    visible="#2fb890",
    attention="#e6a532",
    error="#ef8a62",
)

LIGHT = Colors(
    window="#c6c8ca",
    panel="#cfd1d3",
    field="#dddfe0",
    plot="#d8dadb",
    voxels="#b4b7ba",
    pressed="#a8cbe2",
    line="#a2a5a9",
    text="#16181a",
    dim="#3d4045",
    disabled="#64676c",
    curve="#1b1d1f",
    change="#074f7d",
    visible="#005c43",
    attention="#6b4500",
    error="#8f2f0a",
)

ON_IMAGE = DARK  # colours of what lies over an image, which is black in both themes

STYLE = Path(__file__).parent.parent / "resources" / "window.qss"

CANVAS = "#000000"

TEXT_PIXELS, SMALL_PIXELS = 13, 12  # height of text, and of captions, chips and the status line

_ROLES = {
    "BACKGROUND": "window",
    "PANEL": "panel",
    "FIELD": "field",
    "PLOT": "plot",
    "VOXELS": "voxels",
    "BORDER": "line",
    "TEXT": "text",
    "DIM_TEXT": "dim",
    "FAINT_TEXT": "disabled",
    "CURVE": "curve",
    "ACCENT": "change",
    "CHANGE": "change",
    "VISIBLE": "visible",
    "WARNING": "attention",
    "ERROR": "error",
}
"""Colours of the theme in use, by their names in this module."""

_used = DARK


def __getattr__(name: str) -> str:
    if name not in _ROLES:
        raise AttributeError(name)
    return str(getattr(_used, _ROLES[name]))


def present() -> Colors:
    """Return the colours of the theme that is in use."""
    return _used


def apply_theme(application: QApplication, wanted: ThemeChoice = "system") -> None:
    """Apply a theme to an application; the system's is dark where the system does not say."""
    scheme = application.styleHints().colorScheme()
    is_light = wanted == "light" or (wanted == "system" and scheme is Qt.ColorScheme.Light)
    global _used
    _used = colors = LIGHT if is_light else DARK
    application.setStyle("Fusion")
    font = application.font()
    font.setPixelSize(TEXT_PIXELS)
    application.setFont(font)
    application.setPalette(palette_of(colors))
    application.setStyleSheet(_style_sheet(colors))


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


def _style_sheet(colors: Colors) -> str:
    """Return the style sheet with a theme's colours in the places of their names."""
    names = asdict(colors) | {f"image_{role}": ink for role, ink in asdict(ON_IMAGE).items()}
    return Template(STYLE.read_text("utf-8")).substitute(names, small=SMALL_PIXELS)
