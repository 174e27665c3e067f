"""The bar at the window's upper edge: menus, the volume, the light, and what is asked for often."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QFrame, QHBoxLayout, QMenuBar, QToolButton, QWidget

from app.caption_button import CaptionButton
from app.icons import IconButton
from app.image_view.exactness_slider import ExactnessSlider
from app.image_view.light_ball import LightBall

HEIGHT = 36

FOLD_WIDTH = 1180
"""Width in pixels below which the menus fold into one, and words into their icons."""

LINE_HEIGHT = 20
"""Of the lines between groups, in pixels."""


class TopBar(QWidget):
    """Lays out menus and controls in one row, and folds them where there is less room.

    Attributes
    ----------
    menus : IconButton
        Has all menus while they are folded.
    volume : CaptionButton
        Names the volume.
    """

    def __init__(self, ball: LightBall, light: CaptionButton, exactness: ExactnessSlider) -> None:
        super().__init__()
        self.setProperty("role", "bar")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setFixedHeight(HEIGHT)
        self.menu_bar = QMenuBar()
        self.menu_bar.setNativeMenuBar(False)
        self.menus = IconButton("menu", "Menus", "F10")
        self.menus.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.volume = CaptionButton()
        self.volume.set_title("No volume")
        self.ball, self.light, self.exactness = ball, light, exactness
        self.compare = IconButton("compare", "Compare", "C", "Generator and ground truth together")
        self.difference = IconButton(
            "difference",
            "Difference",
            "D",
            "Where the generator's image differs from the ground truth",
        )
        self.browse = IconButton(
            "browse", "Browse TFs", "B", "A map of TFs, with a picture of each"
        )
        self.save = IconButton("camera", "Save figure", "Ctrl+Shift+S")
        for button in (self.compare, self.difference, self.browse):
            button.setCheckable(True)
        QShortcut(QKeySequence("F10"), self).activated.connect(self.open_menus)
        self._comparison = [self.compare, self.difference, _line()]
        self._is_folded: bool | None = None
        self._lay_out()
        self._fold(False)

    @property
    def is_folded(self) -> bool:
        """Whether the menus are behind one button."""
        return bool(self._is_folded)

    def show_comparison(self, is_shown: bool) -> None:
        """Show what compares two images, or leave it out."""
        for widget in self._comparison:
            widget.setVisible(is_shown)

    def take_menus(self) -> None:
        """Have the menus of the menu bar behind the one button, too."""
        for action in self.menu_bar.actions():
            self.menus.addAction(action)

    def open_menus(self) -> None:
        """Open the menus for the keyboard."""
        if self.is_folded:
            self.menus.showMenu()
        elif self.menu_bar.actions():
            self.menu_bar.setFocus(Qt.FocusReason.ShortcutFocusReason)
            self.menu_bar.setActiveAction(self.menu_bar.actions()[0])

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fold or unfold."""
        super().resizeEvent(event)
        self._fold(self.width() < FOLD_WIDTH)

    def _lay_out(self) -> None:
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 0, 8, 0)
        row.setSpacing(4)
        row.addWidget(self.menus)
        row.addWidget(self.menu_bar, 0, Qt.AlignmentFlag.AlignVCenter)
        row.addWidget(_line())
        row.addWidget(self.volume)
        row.addStretch(1)
        row.addWidget(self.exactness)
        row.addWidget(_line())
        row.addWidget(self.ball)
        row.addWidget(self.light)
        row.addWidget(_line())
        for widget in self._comparison:
            row.addWidget(widget)
        row.addWidget(self.browse)
        row.addWidget(_line())
        row.addWidget(self.save)

    def _fold(self, folded: bool) -> None:
        if folded == self._is_folded:
            return
        self._is_folded = folded
        self.menus.setVisible(folded)
        # Hidden, the bar's keys would be dead; the one button has its menus' keys as well.
        self.menu_bar.setVisible(not folded)
        self.volume.set_folded(folded)
        self.light.set_title(self.light.title)
        self.exactness.set_folded(folded)
        self.browse.set_caption("" if folded else "Browse TFs")
        # At once: what has become wider would be cut until the next event.
        for widget in (self.exactness, self) if self.isVisible() else ():
            layout = widget.layout()
            if layout is not None:
                layout.activate()


def show_action(button: IconButton, action: QAction) -> None:
    """Have a button do what an action does, and look as it does."""
    button.setCheckable(action.isCheckable())

    def follow(_checked: bool = False) -> None:
        button.setChecked(action.isChecked())
        button.setEnabled(action.isEnabled())

    button.clicked.connect(lambda _checked=False: action.trigger())
    # Where the action changes nothing, the button stands as it stood.
    button.clicked.connect(follow)
    action.changed.connect(follow)
    follow()


def _line() -> QFrame:
    line = QFrame()
    line.setProperty("role", "line")
    line.setFixedSize(1, LINE_HEIGHT)
    return line
