"""The bar at the window's upper edge, and the tools over the left image."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QFrame, QHBoxLayout, QMenuBar, QToolButton, QVBoxLayout, QWidget

from app import theme
from app.caption_button import CaptionButton
from app.controls import fill, rule
from app.icons import IconButton
from app.image_view.exactness_slider import ExactnessSlider
from app.image_view.reference_controls import LightBall
from app.state.sensitivity_state import SensitivityState, Tool

HEIGHT, TOOLS_WIDTH = 36, 36

FOLD_WIDTH = 1180  # width in pixels below which the menus fold into one, and words into their icons
TOOLS_PLACE = 8, 40  # distance of the tools to the image's left and upper edge, in pixels


class TopBar(QWidget):
    """Lays out menus and controls in one row, and folds them if room is short."""

    def __init__(self, ball: LightBall, light: CaptionButton, exactness: ExactnessSlider) -> None:
        super().__init__()
        self.setProperty("role", "bar")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setFixedHeight(HEIGHT)
        self.menu_bar = QMenuBar(nativeMenuBar=False)
        self.menus = IconButton("menu", "Menus", "F10")
        self.menus.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.volume = CaptionButton()
        self.volume.title = "No volume"
        self.light, self.exactness = light, exactness
        self.compare = IconButton("compare", "Compare", "C", "Two images side by side")
        self.difference = IconButton(
            "difference",
            "Difference",
            "D",
            "Where the two images differ; B − A: blue is darker in B, red is brighter",
        )
        self.browse = IconButton(
            "browse", "Browse TFs", "B", "Pictures of this volume under many TFs"
        )
        self.save = IconButton("camera", "Save figure", "Ctrl+Shift+S", "An image or a movie")
        for button in (self.compare, self.difference, self.browse):
            button.setCheckable(True)
        QShortcut(QKeySequence("F10"), self).activated.connect(self.open_menus)
        self.is_folded: bool | None = None  # whether the menus are behind one button
        row = fill(QHBoxLayout(self), margins=(8, 0, 8, 0), spacing=4)
        left: list[QWidget] = [self.menus, self.menu_bar, rule(), self.volume]
        for widget in left:
            row.addWidget(widget, 0, Qt.AlignmentFlag.AlignVCenter)
        row.addStretch(1)
        # The ball keeps its place when the light's name changes.
        lit, drawn = (light, ball, rule()), (exactness, rule())
        compared = self.compare, self.difference, rule()
        for widget in (*lit, *drawn, *compared, self.browse, rule(), self.save):
            row.addWidget(widget)
        self._fold(False)

    def open_menus(self) -> None:
        """Open the menus by the keyboard."""
        if self.is_folded:
            self.menus.showMenu()
        elif self.menu_bar.actions():
            self.menu_bar.setFocus(Qt.FocusReason.ShortcutFocusReason)
            self.menu_bar.setActiveAction(self.menu_bar.actions()[0])

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fold or unfold."""
        super().resizeEvent(event)
        self._fold(self.width() < FOLD_WIDTH)

    def _fold(self, folded: bool) -> None:
        if folded == self.is_folded:
            return
        self.is_folded = folded
        self.menus.setVisible(folded)
        # A hidden bar's keys do not work; the one button has them as well.
        self.menu_bar.setVisible(not folded)
        self.volume.is_folded = folded
        self.exactness.set_folded(folded)
        self.browse.set_caption("" if folded else "Browse TFs")
        # At once: a wider control would be cut until the next event.
        for widget in (self.exactness, self) if self.isVisible() else ():
            layout = widget.layout()
            if layout is not None:
                layout.activate()


class ToolStrip(QFrame):
    """Chooses what a drag in the images draws, and shows the planes of the crop box."""

    def __init__(self, regions: SensitivityState) -> None:
        super().__init__()
        self.setProperty("role", "tools")
        self.setFixedWidth(TOOLS_WIDTH)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        colors = theme.ON_IMAGE
        self.rectangle = IconButton(
            "rectangle", "Rectangle", "R", "Draw a region in either image", colors=colors
        )
        self.lasso = IconButton(
            "lasso", "Lasso", "L", "Draw around something in either image", colors=colors
        )
        self.crop = IconButton("crop", "Crop", "K", "Cut the volume by six planes", colors=colors)
        buttons = self.rectangle, self.lasso, self.crop
        for button in buttons:
            button.setCheckable(True)
        fill(QVBoxLayout(self), *buttons, margins=(4, 4, 4, 4), spacing=2)
        self._tools: dict[Tool, IconButton] = {"rectangle": self.rectangle, "lasso": self.lasso}
        for tool, button in self._tools.items():
            button.clicked.connect(lambda on, tool=tool: regions.set_tool(tool if on else None))
        regions.changed.connect(lambda _what: self._show_tool(regions.tool))

    def lie_over(self, canvas: QWidget) -> None:
        """Move over a canvas."""
        if self.parentWidget() is not canvas:
            self.setParent(canvas)
            self.move(*TOOLS_PLACE)
            self.show()
        self.raise_()

    def _show_tool(self, chosen: Tool | None) -> None:
        for tool, button in self._tools.items():
            button.setChecked(tool == chosen)
