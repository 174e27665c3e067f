"""The window's dark colour palette and style sheet."""

from __future__ import annotations

from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication

BACKGROUND = "#181a1f"
PANEL = "#1f2228"
FIELD = "#262a31"
BORDER = "#343943"
TEXT = "#d9dce2"
DIM_TEXT = "#8e95a3"
FAINT_TEXT = "#5d6471"
ACCENT = "#6cb2f5"
WARNING = "#e3b341"
ERROR = "#f08b80"
PRESSED = "#2c4f70"
CANVAS = "#000000"

_STYLE_SHEET = f"""
QMainWindow, QMenuBar, QStatusBar {{ background: {BACKGROUND}; }}
QMenuBar::item {{ padding: 4px 10px; background: transparent; }}
QMenuBar::item:selected {{ background: {FIELD}; border-radius: 4px; }}
QMenu {{ background: {PANEL}; border: 1px solid {BORDER}; padding: 4px; }}
QMenu::item {{ padding: 5px 28px 5px 20px; border-radius: 4px; }}
QMenu::item:selected {{ background: {ACCENT}; color: {BACKGROUND}; }}
QMenu::item:disabled {{ color: {FAINT_TEXT}; }}
QMenu::separator {{ height: 1px; background: {BORDER}; margin: 4px 8px; }}
QStatusBar {{ color: {DIM_TEXT}; }}
QStatusBar::item {{ border: none; }}
QToolTip {{ background: {PANEL}; color: {TEXT}; border: 1px solid {BORDER}; padding: 4px; }}
QSplitter::handle {{ background: {BACKGROUND}; }}
QAbstractSpinBox {{
    background: {FIELD}; border: 1px solid {BORDER}; border-radius: 4px; padding: 3px 6px;
    selection-background-color: {ACCENT}; selection-color: {BACKGROUND};
}}
QAbstractSpinBox::up-button, QAbstractSpinBox::down-button {{ width: 0; border: none; }}
QAbstractSpinBox:focus {{ border-color: {ACCENT}; }}
QAbstractSpinBox[refused="true"] {{ border-color: {ERROR}; }}
QLabel[role="refusal"] {{
    background: {PANEL}; color: {TEXT}; border: 1px solid {ERROR}; padding: 4px 6px;
}}
QAbstractSpinBox:disabled {{ color: {FAINT_TEXT}; background: {PANEL}; }}
QPushButton {{
    background: {FIELD}; border: 1px solid {BORDER}; border-radius: 4px; padding: 4px 12px;
}}
QPushButton:hover {{ border-color: {DIM_TEXT}; }}
QPushButton:pressed {{ background: {BORDER}; }}
QPushButton:checked, QToolButton:checked {{
    background: {PRESSED}; border: 1px solid {ACCENT}; border-radius: 4px;
}}
QPushButton:focus {{ border-color: {ACCENT}; }}
QPushButton:disabled {{ color: {FAINT_TEXT}; background: {PANEL}; }}
QToolButton[role="title"] {{
    font-weight: 600; border: 1px solid transparent; border-radius: 4px; padding: 2px 4px;
}}
QToolButton[role="title"]:hover {{ background: {FIELD}; border-color: {BORDER}; }}
QToolButton[role="title"]::menu-indicator {{ image: none; }}
QToolButton:focus, QComboBox:focus {{ border: 1px solid {ACCENT}; border-radius: 4px; }}
QCheckBox:focus {{ color: {ACCENT}; }}
QGraphicsView[role="plots"] {{ border: 1px solid transparent; border-radius: 4px; }}
QGraphicsView[role="plots"]:focus {{ border-color: {ACCENT}; }}
QToolButton[role="note"] {{
    color: {DIM_TEXT}; border: 1px solid transparent; border-radius: 4px; padding: 2px 4px;
}}
QToolButton[role="note"]:hover {{ background: {FIELD}; border-color: {BORDER}; }}
QToolButton[role="note"]:checked {{ background: {PRESSED}; border-color: {ACCENT}; }}
QLabel[role="title"] {{ font-weight: 600; }}
QLabel[role="dim"] {{ color: {DIM_TEXT}; }}
QLabel[role="readout"] {{
    background: {FIELD}; border: 1px solid {BORDER}; border-radius: 4px; padding: 2px 6px;
}}
QFrame[role="panel"] {{ background: {PANEL}; border-radius: 6px; }}
QFrame[role="notice"] {{ background: #33291a; border-radius: 6px; }}
"""


def apply_theme(application: QApplication) -> None:
    """Apply tfscope's palette and style to an application."""
    application.setStyle("Fusion")
    application.setPalette(_palette())
    application.setStyleSheet(_STYLE_SHEET)


def _palette() -> QPalette:
    role = QPalette.ColorRole
    palette = QPalette()
    for roles, color in (
        ((role.Window, role.Button, role.AlternateBase), BACKGROUND),
        ((role.Base, role.ToolTipBase), PANEL),
        ((role.WindowText, role.Text, role.ButtonText, role.ToolTipText), TEXT),
        ((role.PlaceholderText,), DIM_TEXT),
        ((role.Highlight, role.Link), ACCENT),
        ((role.HighlightedText,), BACKGROUND),
    ):
        for each in roles:
            palette.setColor(each, QColor(color))
    for each in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, each, QColor(FAINT_TEXT))
    return palette
