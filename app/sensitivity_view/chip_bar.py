"""Chips of what is drawn over the TF: each says what a layer means, and shows or hides it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Literal

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QActionGroup, QColor, QIcon, QPainter, QPen, QPixmap
from PySide6.QtWidgets import QFrame, QHBoxLayout, QInputDialog, QMenu, QToolButton, QWidget

from app import theme
from app.controls import add_action, add_title
from app.icons import IconButton
from app.menu_tips import show_tips
from app.state.sensitivity_state import EngineChoice, SensitivityState, Tool
from app.tf_editor.histogram import HistogramLayer
from model.sensitivity.display import Measure

_ICON = QSize(14, 12)
AROUND = 18  # beside and between a chip's colour and its text, in pixels
_Form = Literal["change", "visible", "voxels", "region"]


class Chip(QToolButton):
    """A layer's name and its colour, as line or area; off it is dim."""

    def __init__(self, name: str, form: _Form, tip: str) -> None:
        super().__init__()
        self._form = form
        self._is_on = True
        self._caption = name
        self.setProperty("role", "chip")
        self.setAccessibleName(name)
        self.setToolTip(tip)
        self.setFixedHeight(24)
        self.setIconSize(_ICON)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        # After a click, keys such as W are the window's again.
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.set_caption(name)

    @property
    def caption(self) -> str:
        """Its text, also where there is no room for it."""
        return self._caption

    def set_caption(self, text: str) -> None:
        """Say another text."""
        self._caption = text
        self.set_folded(self.toolButtonStyle() == Qt.ToolButtonStyle.ToolButtonIconOnly)

    def set_folded(self, folded: bool) -> None:
        """Show the colour alone, or with the text."""
        style = Qt.ToolButtonStyle
        self.setToolButtonStyle(
            style.ToolButtonIconOnly if folded else style.ToolButtonTextBesideIcon
        )
        self.setText(f" {self._caption}")
        self._draw()

    def sizeHint(self) -> QSize:
        """Return the room of colour and text, of which Qt's style takes more than it fills."""
        hint = super().sizeHint()
        if self.toolButtonStyle() == Qt.ToolButtonStyle.ToolButtonIconOnly:
            return hint
        text = self.fontMetrics().horizontalAdvance(self.text())
        return QSize(min(_ICON.width() + text + AROUND, hint.width()), hint.height())

    def minimumSizeHint(self) -> QSize:
        """Return the same."""
        return self.sizeHint()

    def set_on(self, on: bool) -> None:
        """Look as if the layer is shown, or not."""
        self._is_on = on
        self.setProperty("off", not on)
        self.style().unpolish(self)
        self.style().polish(self)
        if self.isCheckable():
            self.setChecked(on)
        self._draw()

    def _draw(self) -> None:
        colors = {"visible": theme.VISIBLE, "voxels": theme.FAINT_TEXT}
        color = QColor(colors.get(self._form, theme.CHANGE))
        ratio = self.devicePixelRatioF()
        picture = QPixmap(_ICON * ratio)
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not self._is_on:
            painter.setOpacity(0.45)
        if self._form == "change":
            painter.fillRect(QRectF(0, 5, 14, 2), color)
        elif self._form != "region":
            painter.setPen(QPen(color, 1))
            painter.setBrush(color if self._is_on else Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(QRectF(1, 1.5, 12, 9), 2, 2)
        else:
            pen = QPen(color, 1.4, Qt.PenStyle.DashLine)
            pen.setDashPattern([2, 1.4])
            painter.setPen(pen)
            painter.drawRoundedRect(QRectF(1, 1.5, 12, 9), 2, 2)
        painter.end()
        self.setIcon(QIcon(picture))


MEASURES: dict[str, tuple[Measure, str]] = {
    "Brightness (±)": (
        "signed",
        "Whether the region becomes brighter (above 0) or darker (below 0). A black region has no "
        "such derivative (Eq. 11 of the paper).",
    ),
    "Any change": (
        "change",
        "How much the region's pixels change in any direction, also where they are black (norm of "
        "dI)",
    ),
}

ENGINES: dict[str, tuple[EngineChoice, str]] = {
    "Automatic": (
        "automatic",
        "The ray caster's exact derivative where it is fast enough, else the model's; at rest "
        "both, to compare them",
    ),
    "Exact": (
        "exact",
        "The ray caster; in path-traced light, the derivative of another light",
    ),
    "Learned": ("learned", "The model of this volume"),
}

TOOLS: dict[str, Tool] = {"Draw a rectangle\tR": "rectangle", "Draw a lasso\tL": "lasso"}

FOLDED_BELOW = 1100  # width of the editor below which the chips need less room, in pixels

CHANGE_TIP = (
    "The curve: where in the TF an edit changes the region. Its zero lies at half height.\n"
    "The flags mark the edits that change most. Both come with a region."
)
VISIBLE_TIP = (
    "The green area: how much of each value the region shows.\n"
    "Point at a value to see where it is in the image."
)
VOXELS_TIP = "How many voxels have each value, on a logarithmic scale"


class ChipBar(QWidget):
    """Chips for the region, and for the layers of the plot, next to the panel's button."""

    def __init__(
        self,
        asked: SensitivityState,
        histogram: HistogramLayer,
        open_panel: Callable[[bool], object],
        show_table: Callable[[], object],
    ) -> None:
        super().__init__()
        self._state, self._histogram = asked, histogram
        self._open_panel, self._show_table = open_panel, show_table
        self.region = Chip(
            "Whole image", "region", "The part of the image that curve and values refer to"
        )
        self.change = Chip("Change", "change", CHANGE_TIP)
        self.more = QToolButton()
        self.visible = Chip("Visible", "visible", VISIBLE_TIP)
        self.voxels = Chip("Voxels", "voxels", VOXELS_TIP)
        for chip in (self.change, self.visible, self.voxels):
            chip.setCheckable(True)
        self.panel = IconButton("panel", "Values and edits", "F8")
        self.panel.setCheckable(True)
        self.regions_menu = QMenu(self)
        self.change_menu = QMenu(self)
        self._groups: list[QActionGroup] = []
        self._lay_out()
        self._fill_change_menu()
        self._connect()
        self.refresh()

    def _lay_out(self) -> None:
        for button, menu in ((self.region, self.regions_menu), (self.more, self.change_menu)):
            show_tips(menu)
            button.setMenu(menu)
            button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.more.setText("▾")
        self.more.setProperty("role", "chip")
        self.more.setFixedSize(24, 24)
        self.more.setAccessibleName("Change: measure and engine")
        self.more.setToolTip("What the curve measures, and how it is computed")
        self.more.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(4)
        for part in (
            self.region, _rule(), self.change, self.more, self.visible, self.voxels, _rule(),
            self.panel,
        ):  # fmt: skip
            row.addWidget(part)
        row.insertSpacing(0, 4)
        # The arrow belongs to the word before it.
        row.insertSpacing(row.indexOf(self.more), -row.spacing())

    def _fill_change_menu(self) -> None:
        menu, state = self.change_menu, self._state
        self._groups = [
            _add_choices(menu, "The curve shows", MEASURES, lambda m: state.choose(measure=m)),
            _add_choices(menu, "Computed by", ENGINES, lambda e: state.choose(engine=e)),
        ]
        self.said = menu.addAction("")
        self.said.setEnabled(False)
        add_action(menu, "As table…", self._show_table).setToolTip("The numbers of the curve")
        menu.addSeparator()
        self.lock = menu.addAction("Lock scale")
        self.lock.setCheckable(True)
        self.lock.setToolTip("Keep the scale of colours and curve, to compare")
        self.lock.triggered.connect(lambda on: state.choose(locked=on))
        self._folded_voxels = menu.addAction("Voxels")
        self._folded_voxels.setCheckable(True)
        self._folded_voxels.setToolTip(VOXELS_TIP)
        self._folded_voxels.triggered.connect(self._show_voxels)

    def _connect(self) -> None:
        state = self._state
        self.change.clicked.connect(lambda on: state.show_layer("curve", on))
        self.visible.clicked.connect(lambda on: state.show_layer("visible", on))
        self.voxels.clicked.connect(self._show_voxels)
        self.regions_menu.aboutToShow.connect(self.fill_regions)
        self.panel.clicked.connect(self._open_panel)

    @property
    def controls(self) -> list[QWidget]:
        """Widgets that Tab reaches, in its order."""
        return [self.region, self.change, self.more, self.visible, self.voxels, self.panel]

    def fill_regions(self) -> None:
        """List the regions, and what can be done with them."""
        menu, state = self.regions_menu, self._state
        menu.clear()
        names = ["Whole image", *(region.name for region in state.regions)]
        active = 0 if state.active is None else state.active + 1
        for number, name in enumerate(names):
            action = add_action(menu, name, partial(self._choose_region, number))
            action.setCheckable(True)
            action.setChecked(number == active)
        menu.addSeparator()
        for text, tool in TOOLS.items():
            action = add_action(menu, text, partial(self._toggle_tool, tool))
            action.setCheckable(True)
            action.setChecked(state.tool == tool)
        menu.addSeparator()
        for text, slot in (
            ("Rename…", self.ask_name), ("Remove\tShift+Del", state.remove_region),
        ):  # fmt: skip
            add_action(menu, text, slot).setEnabled(state.active is not None)

    def _toggle_tool(self, tool: Tool) -> None:
        self._state.set_tool(None if self._state.tool == tool else tool)

    def _choose_region(self, number: int) -> None:
        self._state.activate(number - 1 if number else None)
        if number:
            self._open_panel(True)

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
        self.region.set_caption(f"{short} ▾")
        self.region.setAccessibleName(f"Region: {name}")
        self.region.setEnabled(choices.shown)
        self.change.set_on(self._state.shows_curve)
        self.visible.set_on(choices.shown and choices.visible)
        self.voxels.set_on(self._histogram.is_shown)
        self.lock.setChecked(choices.locked)
        self._folded_voxels.setChecked(self._histogram.is_shown)
        for group, entries, chosen in (
            (self._groups[0], MEASURES, choices.measure),
            (self._groups[1], ENGINES, choices.engine),
        ):
            index = [value for value, _ in entries.values()].index(chosen)
            group.actions()[index].setChecked(True)

    def say_source(self, said: str) -> None:
        """Name the source of the curve, in the menu and in the tooltip."""
        self.said.setText(said or "No answer yet")
        self.change.setToolTip(f"{CHANGE_TIP}\n{said}" if said else CHANGE_TIP)

    def fold(self, width: int, has_panel: bool) -> None:
        """Take less room in a narrow editor, and least next to the panel."""
        is_narrow = width < FOLDED_BELOW
        self.voxels.setVisible(not is_narrow)
        self._folded_voxels.setVisible(is_narrow)
        for chip in (self.region, self.change, self.visible):
            chip.set_folded(is_narrow and has_panel)

    def _show_voxels(self, on: bool) -> None:
        self._histogram.set_shown(on)
        self.refresh()


def _add_choices(
    menu: QMenu, title: str, entries: Mapping[str, tuple[Any, str]], choose: Callable[[Any], object]
) -> QActionGroup:
    add_title(menu, title)
    group = QActionGroup(menu)
    for name, (value, tip) in entries.items():
        action = add_action(menu, name, partial(choose, value))
        action.setCheckable(True)
        action.setToolTip(tip)
        group.addAction(action)
    return group


def _rule() -> QFrame:
    rule = QFrame()
    rule.setProperty("role", "line")
    rule.setFixedSize(1, 18)
    return rule
