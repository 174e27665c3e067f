"""The strip of tools over the left image: rectangle, lasso and crop."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QVBoxLayout, QWidget

from app import theme
from app.icons import IconButton
from app.state.sensitivity_state import SensitivityState
from app.window.crop_card import CropCard

WIDTH = 36
PLACE = 8, 40
"""Distance to the image's left and upper edge, below its caption, in pixels."""


class ToolStrip(QFrame):
    """Chooses what a drag in the images draws, and shows the planes of the crop box."""

    def __init__(self, regions: SensitivityState, crop: CropCard) -> None:
        super().__init__()
        self.setProperty("role", "tools")
        self.setFixedWidth(WIDTH)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        colors = theme.ON_IMAGE
        self.rectangle = IconButton(
            "rectangle", "Rectangle", "R", "Draw a region in either image", colors=colors
        )
        self.lasso = IconButton(
            "lasso", "Lasso", "L", "Draw around something in either image", colors=colors
        )
        self.crop = IconButton("crop", "Crop", "K", "Cut the volume by six planes", colors=colors)
        column = QVBoxLayout(self)
        column.setContentsMargins(4, 4, 4, 4)
        column.setSpacing(2)
        for button in (self.rectangle, self.lasso, self.crop):
            button.setCheckable(True)
            column.addWidget(button)
        self.rectangle.clicked.connect(lambda on: regions.set_tool("rectangle" if on else None))
        self.lasso.clicked.connect(lambda on: regions.set_tool("lasso" if on else None))
        self.crop.clicked.connect(crop.set_shown)
        regions.changed.connect(lambda _what: self._show_tool(regions.tool))
        crop.shownChanged.connect(self.crop.setChecked)

    def lie_over(self, canvas: QWidget | None) -> None:
        """Lie over a canvas; over none, be hidden."""
        if canvas is not None and self.parentWidget() is not canvas:
            self.setParent(canvas)
            self.move(*PLACE)
        self.setVisible(canvas is not None)
        if canvas is not None:
            self.raise_()

    def _show_tool(self, tool: object) -> None:
        self.rectangle.setChecked(tool == "rectangle")
        self.lasso.setChecked(tool == "lasso")
