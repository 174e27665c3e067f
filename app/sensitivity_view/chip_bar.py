"""Chips of the layers over the TF: each names a layer, and shows or hides it."""

from collections.abc import Callable
from functools import partial
from typing import Literal

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap
from PySide6.QtWidgets import QHBoxLayout, QInputDialog, QMenu, QToolButton, QWidget

from app import theme
from app.controls import (
    add_action,
    add_choices,
    add_switch,
    add_title,
    fill,
    named,
    rule,
    show_tips,
    text_button,
)
from app.icons import IconButton
from app.state.sensitivity_state import EngineChoice, SensitivityState
from app.tf_editor.histogram import HistogramLayer
from model.sensitivity.display import Measure

_ICON = QSize(14, 12)
AROUND = 18  # around and between a chip's colour and its text, in pixels
_Form = Literal["change", "visible", "voxels", "region"]


class Chip(QToolButton):
    """A layer's name and its colour, as line or area; off it is dim."""

    def __init__(
        self, name: str, form: _Form, tip: str, switch: Callable[[bool], object] | None = None
    ) -> None:
        super().__init__()
        self._form = form
        self.caption, self.longest, self.is_on = name, "", True
        self.is_folded = False  # whether the colour is shown without the text
        if switch is not None:
            self.setCheckable(True)
            self.clicked.connect(lambda on: switch(on))
        self.setProperty("role", "chip")
        named(self, name, tip)
        self.setFixedHeight(24)
        self.setIconSize(_ICON)
        self.refresh()

    def sizeHint(self) -> QSize:
        """Return the size of colour and text; Qt's style would add unused space."""
        hint = super().sizeHint()
        if self.is_folded:
            return hint
        text = self.fontMetrics().horizontalAdvance(f" {max(self.caption, self.longest, key=len)}")
        return QSize(min(_ICON.width() + text + AROUND, hint.width()), hint.height())

    def refresh(self) -> None:
        """Show its text, whether the layer is on, and its colour in the present theme."""
        style = Qt.ToolButtonStyle
        self.setToolButtonStyle(
            style.ToolButtonIconOnly if self.is_folded else style.ToolButtonTextBesideIcon
        )
        self.setText(f" {self.caption}")
        self.setProperty("off", not self.is_on)
        self.style().unpolish(self)
        self.style().polish(self)
        if self.isCheckable():
            self.setChecked(self.is_on)
        colors = {"visible": theme.VISIBLE, "voxels": theme.DISABLED}
        color = QColor(colors.get(self._form, theme.CHANGE))
        ratio = self.devicePixelRatioF()
        picture = QPixmap(_ICON * ratio)
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not self.is_on:
            painter.setOpacity(0.45)
        pen = QPen(color, 1)
        if self._form == "change":
            painter.fillRect(QRectF(0, 5, 14, 2), color)
        else:
            if self._form == "region":
                pen.setWidthF(1.4)
                pen.setDashPattern([2, 1.4])
            elif self.is_on:
                painter.setBrush(color)
            painter.setPen(pen)
            painter.drawRoundedRect(QRectF(1, 1.5, 12, 9), 2, 2)
        painter.end()
        self.setIcon(QIcon(picture))


MEASURES: dict[Measure, tuple[str, str]] = {
    "signed": (
        "Brightness (±)",
        "Whether the region becomes brighter (above 0) or darker (below 0). A black region has no "
        "such derivative (Eq. 11 of the paper).",
    ),
    "change": (
        "Any change",
        "How much the region's pixels change, brighter or darker, also where they are black (norm "
        "of dI)",
    ),
}

ENGINES: dict[EngineChoice, tuple[str, str]] = {
    "automatic": (
        "Automatic",
        "The ray caster's exact derivative; where the model's image is shown, the model's, too, to "
        "compare them, or where the ray caster is slow",
    ),
    "exact": ("Exact", "The ray caster's derivative; in path-traced light, another light's"),
    "learned": ("Learned", "The model of this volume"),
}

FOLDED_BELOW = 1100  # width of the editor below which the chips need less room, in pixels

CHANGE_TIP = (
    "The curve: at which values an edit of the TF changes the region; zero is at half height.\n"
    "The flags mark the edits that change most. Both are shown once there is a region."
)
VISIBLE_TIP = (
    "The green area: how much of each value the image, or the active region, shows.\n"
    "Point at a value to see where it is in the image."
)
VISIBLE_IN = "Visible in {}"
VOXELS_TIP = "How many voxels have each value, on a logarithmic scale"


class ChipBar(QWidget):
    """Chips for the region, and for the layers of the plot, next to the panel's button."""

    def __init__(
        self, asked: SensitivityState, histogram: HistogramLayer, show_table: Callable[[], object]
    ) -> None:
        super().__init__()
        self._state, self._histogram = asked, histogram
        self.region = Chip(
            "Whole image", "region", "The part of the image that curve and values refer to"
        )
        self.change = Chip("Change", "change", CHANGE_TIP, partial(asked.show_layer, "curve"))
        tip = "What the curve measures, and how it is computed"
        self.more = named(text_button("▾", tip, role="chip"), "Change: measure and engine")
        self.more.setFixedSize(24, 24)
        self.visible = Chip("Visible", "visible", VISIBLE_TIP, partial(asked.show_layer, "visible"))
        self.visible.longest = VISIBLE_IN.format("region")  # so that nothing next to it moves
        self.voxels = Chip("Voxels", "voxels", VOXELS_TIP, self._show_voxels)
        self.panel = IconButton("panel", "Values and edits", "F8")
        self.panel.setCheckable(True)
        self.panel.clicked.connect(asked.open_panel)
        self.regions_menu = QMenu(self)
        self.regions_menu.aboutToShow.connect(self.fill_regions)
        menu = QMenu(self)
        for button, its_menu in ((self.region, self.regions_menu), (self.more, menu)):
            show_tips(its_menu)
            button.setMenu(its_menu)
            button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        add_title(menu, "The curve shows")
        self._measures = add_choices(menu, MEASURES, lambda measure: asked.choose(measure=measure))
        add_title(menu, "Computed by")
        self._engines = add_choices(menu, ENGINES, lambda engine: asked.choose(engine=engine))
        add_action(menu, "As table…", show_table).setToolTip("The numbers of the curve")
        menu.addSeparator()
        tip = "Keep the scale of colours and curve, to compare"
        self.lock = add_switch(menu, "Lock scale", tip, lambda on: asked.choose(locked=on))
        self._folded_voxels = add_switch(menu, "Voxels", VOXELS_TIP, self._show_voxels)
        # The arrow stays with the word before it.
        change = fill(QHBoxLayout(), self.change, self.more)
        parts = self.visible, self.voxels, rule(18), self.panel, rule(18), self.region
        fill(QHBoxLayout(self), 4, rule(18), change, *parts, spacing=4)
        self.refresh()

    @property
    def controls(self) -> list[QWidget]:
        """Widgets that Tab reaches, in its order."""
        return [self.change, self.more, self.visible, self.voxels, self.panel, self.region]

    def fill_regions(self) -> None:
        """Fill the menu with the regions and actions on them."""
        menu, state = self.regions_menu, self._state
        menu.clear()
        names = ["Whole image", *(region.name for region in state.regions)]
        active = 0 if state.active is None else state.active + 1
        for number, name in enumerate(names):
            action = add_action(menu, name, partial(self._choose_region, number))
            action.setCheckable(True)
            action.setChecked(number == active)
        menu.addSeparator()
        for text, slot in (
            ("Rename…", self.ask_name), ("Remove\tShift+Del", state.remove_region),
        ):  # fmt: skip
            add_action(menu, text, slot).setEnabled(state.active is not None)

    def _choose_region(self, number: int) -> None:
        self._state.activate(number - 1 if number else None)
        if number:
            self._state.open_panel()

    def ask_name(self) -> QInputDialog | None:
        """Ask for another name of the active region."""
        if self._state.active is None:
            return None
        dialog = QInputDialog(self)
        dialog.setWindowTitle("Rename region")
        dialog.setLabelText("Name of the region:")
        dialog.setTextValue(self._state.region_name)
        dialog.textValueSelected.connect(self._state.rename_region)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()
        return dialog

    def refresh(self) -> None:
        """Show the present choices."""
        choices, name = self._state.choices, self._state.region_name
        short = name if len(name) <= 20 else f"{name[:19]}…"
        self.region.caption = f"{short} ▾"
        self.region.setAccessibleName(f"Region: {name}")
        self.region.setEnabled(choices.shown)
        whole = self._state.active is None
        self.visible.caption = VISIBLE_IN.format("image" if whole else "region")
        self.change.is_on = self._state.shows_curve
        self.visible.is_on = choices.shown and choices.visible
        self.voxels.is_on = self._histogram.curve.isVisible()
        for chip in (self.region, self.change, self.visible, self.voxels):
            chip.refresh()
        self.lock.setChecked(choices.locked)
        self._folded_voxels.setChecked(self.voxels.is_on)
        self._measures[choices.measure].setChecked(True)
        self._engines[choices.engine].setChecked(True)

    def say_source(self, said: str) -> None:
        """Name the source of the curve in the tooltip."""
        self.change.setToolTip(f"{CHANGE_TIP}\n{said}" if said else CHANGE_TIP)

    def fold(self, width: int, has_panel: bool) -> None:
        """Take less room in a narrow editor, and the least next to the panel."""
        is_narrow = width < FOLDED_BELOW
        self.voxels.setVisible(not is_narrow)
        self._folded_voxels.setVisible(is_narrow)
        for chip in (self.region, self.change, self.visible):
            chip.is_folded = is_narrow and has_panel
            chip.refresh()

    def _show_voxels(self, on: bool) -> None:
        self._histogram.curve.setVisible(on)
        self.refresh()
