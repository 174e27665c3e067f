"""The window's colours, dark and light, and its style sheet.

The names in capitals are the colours of the theme that is in use: take them when you
paint, and renew a pen that you keep on `QEvent.PaletteChange`. What lies over an image is dark in
both themes, and takes its colours from :data:`ON_IMAGE`.
"""

from __future__ import annotations

from dataclasses import dataclass

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

ON_IMAGE = DARK
"""Colours of what lies over an image, which is black in both themes."""

CANVAS = "#000000"

TEXT_PIXELS, SMALL_PIXELS = 13, 12
"""Height of text, and of captions, chips and the status line."""

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


def _style_sheet(c: Colors) -> str:
    return f"""
QMainWindow, QMenuBar, QStatusBar, QWidget[role="bar"] {{ background: {c.window}; }}
QMenuBar::item {{ padding: 4px 8px; background: transparent; border-radius: 4px; }}
QMenuBar::item:selected {{ background: {c.field}; }}
QMenu {{ background: {c.field}; border: 1px solid {c.line}; padding: 4px; }}
QMenu::item {{ padding: 5px 28px 5px 20px; border-radius: 4px; }}
QMenu::item:selected {{ background: {c.change}; color: {c.window}; }}
QMenu::icon:checked {{ border: 2px solid {c.change}; border-radius: 3px; }}
QMenu::item:disabled {{ color: {c.disabled}; background: transparent; }}
QMenu::separator {{ height: 1px; background: {c.line}; margin: 4px 8px; }}
QStatusBar {{ color: {c.dim}; font-size: {SMALL_PIXELS}px; }}
QStatusBar::item {{ border: none; }}
QToolTip {{ background: {c.field}; color: {c.text}; border: 1px solid {c.line}; padding: 4px; }}
QSplitter::handle {{ background: {c.line}; }}
{_controls(c)}
QGraphicsView[role="plots"] {{ border: 1px solid transparent; border-radius: 4px; }}
QGraphicsView[role="plots"][ringed="true"] {{ border-color: {c.change}; }}
QLabel[role="title"] {{ font-weight: 600; }}
QLabel[role="dim"] {{ color: {c.dim}; }}
QLabel[role="on image"] {{
    color: {ON_IMAGE.text}; background: {ON_IMAGE.window}; border-radius: 4px; padding: 0 8px;
    font-size: {SMALL_PIXELS}px;
}}
QLabel[role="readout"] {{
    background: {c.field}; border: 1px solid {c.line}; border-radius: 4px; padding: 2px 6px;
}}
QFrame[role="panel"] {{ background: {c.panel}; }}
QFrame[role="line"] {{ background: {c.line}; border: none; }}
{_dock(c)}
{_on_image(ON_IMAGE)}
"""


def _controls(c: Colors) -> str:
    """Return the style of fields, buttons and boxes."""
    return f"""
QAbstractSpinBox, QLineEdit {{
    background: {c.field}; border: 1px solid {c.line}; border-radius: 4px; padding: 3px 6px;
    selection-background-color: {c.change}; selection-color: {c.window};
}}
QAbstractSpinBox::up-button, QAbstractSpinBox::down-button {{ width: 0; border: none; }}
QAbstractSpinBox:focus, QLineEdit:focus {{ border-color: {c.change}; }}
QAbstractSpinBox[refused="true"] {{ border-color: {c.error}; }}
QAbstractSpinBox:disabled {{ color: {c.disabled}; background: {c.panel}; }}
QPushButton {{
    background: {c.field}; border: 1px solid {c.line}; border-radius: 4px; padding: 4px 12px;
}}
QPushButton:hover {{ border-color: {c.dim}; }}
QPushButton:pressed {{ background: {c.line}; }}
QPushButton:checked, QToolButton:checked {{
    background: {c.pressed}; border: 1px solid {c.change}; border-radius: 4px;
}}
QPushButton:focus {{ border-color: {c.change}; }}
QPushButton:disabled {{ color: {c.disabled}; background: {c.panel}; }}
QToolButton[role="flat"]::menu-indicator {{ image: none; }}
QToolButton[role="flat"] {{
    background: transparent; border: 1px solid transparent; border-radius: 4px; padding: 2px 4px;
}}
QToolButton[role="flat"]:hover {{ background: {c.field}; }}
QToolButton[role="flat"]:checked {{ background: {c.pressed}; border-color: {c.change}; }}
QToolButton[role="flat"]:disabled {{ color: {c.disabled}; }}
QToolButton:focus, QComboBox:focus {{ border: 2px solid {c.change}; border-radius: 4px; }}
QCheckBox:focus {{ color: {c.change}; }}
QCheckBox::indicator {{
    width: 11px; height: 11px; border-radius: 2px; border: 1px solid {c.dim};
    background: {c.field};
}}
QCheckBox::indicator:checked {{ background: {c.change}; border-color: {c.change}; }}
QCheckBox::indicator:disabled {{ border-color: {c.disabled}; }}
"""


def _dock(c: Colors) -> str:
    """Return the style of the dock: chips, the card at a handle, flags and the panel's rows."""
    return f"""
QToolButton[role="chip"] {{
    background: transparent; border: 1px solid transparent; border-radius: 4px;
    padding: 0px 4px; font-size: {SMALL_PIXELS}px;
}}
QToolButton[role="chip"]:hover {{ background: {c.field}; }}
QToolButton[role="chip"]:checked {{ background: transparent; border-color: transparent; }}
QToolButton[role="chip"][off="true"] {{ color: {c.dim}; }}
QToolButton[role="chip"]:focus {{ border: 2px solid {c.change}; }}
QToolButton[role="chip"]:disabled {{ color: {c.disabled}; }}
QToolButton[role="chip"]::menu-indicator {{ image: none; }}
QFrame[role="mode card"], QFrame[role="tag"] {{
    background: {c.field}; border: 1px solid {c.line}; border-radius: 6px;
}}
QFrame[role="mode card"] QLabel, QFrame[role="mode card"] QAbstractSpinBox,
QFrame[role="tag"] QLabel, QFrame[role="side"] QLabel, QFrame[role="side"] QToolButton,
QFrame[role="side"] QAbstractSpinBox, QFrame[role="side"] QPushButton {{
    font-size: {SMALL_PIXELS}px;
}}
QAbstractSpinBox[role="card"] {{
    background: transparent; border-color: transparent; padding: 0px 2px;
}}
QAbstractSpinBox[role="card"]:hover {{ border-color: {c.line}; }}
QAbstractSpinBox[role="card"]:focus {{ border: 1px solid {c.change}; background: {c.panel}; }}
QAbstractSpinBox[role="card"][refused="true"] {{ border-color: {c.error}; }}
QToolButton[role="change flag"] {{
    background: {c.change}; color: {c.window}; border: none; border-radius: 3px;
    padding: 0px 5px; font-size: {SMALL_PIXELS}px;
}}
QToolButton[role="change flag"]:focus {{ border: 2px solid {c.text}; }}
QToolButton[role="change flag"]:disabled {{ background: {c.pressed}; color: {c.dim}; }}
QFrame[role="side"] {{ background: {c.panel}; border: none; border-left: 1px solid {c.line}; }}
QScrollArea[role="side"], QWidget[role="side page"] {{ background: transparent; border: none; }}
"""


def _on_image(c: Colors) -> str:
    """Return the style of what floats over images: dark in both themes."""
    return f"""
QFrame[role="card"], QFrame[role="tools"] {{
    background: {c.panel}; color: {c.text}; border: 1px solid {c.line}; border-radius: 6px;
}}
QFrame[role="tools"] {{ background: {c.window}; border-color: {c.window}; }}
QFrame[role="card"][tone="error"] {{ border: 1px solid {c.error}; border-left-width: 3px; }}
QFrame[role="card"] QLabel {{ color: {c.text}; border: none; }}
QFrame[role="card"] QLabel[role="dim"] {{ color: {c.dim}; }}
QFrame[role="card"] QPushButton, QFrame[role="card"] QToolButton,
QFrame[role="card"] QAbstractSpinBox, QFrame[role="tools"] QToolButton {{
    background: {c.field}; color: {c.text}; border: 1px solid {c.line}; border-radius: 4px;
}}
QFrame[role="card"] QToolButton, QFrame[role="tools"] QToolButton {{
    background: transparent; border-color: transparent;
}}
QFrame[role="card"] QToolButton:hover, QFrame[role="tools"] QToolButton:hover {{
    background: {c.field};
}}
QFrame[role="card"] QToolButton:checked, QFrame[role="tools"] QToolButton:checked {{
    background: {c.pressed}; border-color: {c.change};
}}
QFrame[role="card"] QPushButton:hover {{ border-color: {c.dim}; }}
QFrame[role="card"] QSlider::groove:horizontal {{
    height: 4px; background: {c.line}; border-radius: 2px;
}}
QFrame[role="card"] QSlider::handle:horizontal {{
    width: 9px; margin: -6px 0; background: {c.dim}; border-radius: 3px;
}}
QFrame[role="card"] QSlider::handle:horizontal:hover {{ background: {c.text}; }}
QFrame[role="card"] QRangeSlider {{ qproperty-barColor: {c.change}; }}
QFrame[role="card"] QPushButton:disabled {{ color: {c.disabled}; }}
QFrame[role="card"] QPushButton:focus, QFrame[role="card"] QToolButton:focus,
QFrame[role="card"] QAbstractSpinBox:focus, QFrame[role="tools"] QToolButton:focus {{
    border: 2px solid {c.change};
}}
"""
