"""The TF editor's menus: presets with pictures, colours, conversions, range and axis."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QIcon, QImage, QPixmap, QShowEvent
from PySide6.QtWidgets import (
    QFormLayout,
    QFrame,
    QListWidget,
    QListWidgetItem,
    QMenu,
    QToolButton,
    QWidget,
    QWidgetAction,
)

from app.controls import (
    Painted,
    add_action,
    add_switch,
    label,
    named,
    picture_icon,
    show_tips,
    text_button,
)
from app.icons import BUTTON, IconButton
from app.number_box import NumberBox, significant
from app.state.viewer_state import ViewerState
from app.tf_editor.handles import HandleMoves
from app.tf_editor.histogram import percentile_range
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.range_layer import RangeLayer
from app.tf_editor.unit_axis import OpacityScale, ScalarAxis
from model.scene.ranges import fit_to_range
from model.scene.tf_editing import as_curve, fitted_modes
from model.scene.tf_presets import (
    COLOR_MAPS,
    Preset,
    color_tf_of_map,
    looks_like_hu,
    map_colors,
    presets,
    reversed_colors,
)
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import values_at

PICTURE = 96  # sides of a picture, in pixels
CELL = QSize(118, 128)  # size of a picture with its name
ROOM = 8  # margin around all pictures, in pixels
COLUMNS, MOST_ROWS = 4, 3  # pictures in a row, and rows visible at once even on small screens


class PresetMenu(QMenu):
    """Shows presets over the volume's scalar range, and emits the chosen one."""

    chosen = Signal(object)  # with the chosen Preset
    picturesWanted = Signal(object)  # emitted with the listed presets when the menu opens

    def __init__(self, state: ViewerState, area: PlotArea, parent: QWidget | None = None) -> None:
        super().__init__("Presets", parent)
        self._state, self._area = state, area
        self._listed: tuple[Preset, ...] = ()
        self.own: Callable[[], Sequence[Preset]] = tuple  # the user's own, listed last
        self.list = named(QListWidget(), "Presets")
        self.list.setGridSize(CELL)
        self.list.setWordWrap(True)
        self.list.setViewMode(QListWidget.ViewMode.IconMode)
        self.list.setMovement(QListWidget.Movement.Static)
        self.list.setIconSize(QSize(PICTURE, PICTURE))
        self.list.setFrameShape(QListWidget.Shape.NoFrame)
        self.list.viewport().setAutoFillBackground(False)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        # A click or Enter takes one; arrow keys only select.
        self.list.itemClicked.connect(self.take)
        self.list.itemActivated.connect(self.take)
        action = QWidgetAction(self)
        action.setDefaultWidget(self.list)
        self.addAction(action)
        # Else an entry that the mouse has crossed stays marked.
        self.list.setMouseTracking(True)
        self.list.itemEntered.connect(lambda _item: self.setActiveAction(action))
        show_tips(self)
        self.aboutToShow.connect(self._fill)

    def listed(self) -> tuple[Preset, ...]:
        """Return the presets of the volume, the default one first."""
        histogram = self._area.histogram
        scalar_range = self._state.scalar_range
        # Like the others, it keeps the range.
        first = fit_to_range(self._state.default, scalar_range)
        default = Preset("Default", "The volume's first TF", first)
        if not self._state.interpolates:
            # Looks such as skin or glass make no sense for labels.
            return default, *self.own()
        # Of the whole volume, so that the order does not depend on the shown range.
        units, scale, axes = self._state.units, self._state.scale, self._state.axis_labels
        of_patient = bool(axes) or looks_like_hu(self._area.data_range, units)
        counts, edges = histogram.counts, histogram.edges
        others = presets(scalar_range, counts, edges, units, scale, of_patient)
        return default, *others, *self.own()

    def take(self, item: QListWidgetItem) -> None:
        """Use a preset, and close the menu."""
        if self.isVisible():
            self.hide()
        self.chosen.emit(self._listed[self.list.row(item)])

    def set_pictures(self, pictures: Sequence[QImage]) -> None:
        """Show how the volume looks under each preset, in the order of the list."""
        for row, picture in enumerate(pictures):
            self.list.item(row).setIcon(picture_icon(picture, PICTURE))

    def showEvent(self, event: QShowEvent) -> None:
        """Let the arrow keys move among the pictures, and mark the present TF's."""
        super().showEvent(event)
        self.list.setFocus()
        tfs, present = [preset.tf for preset in self._listed], self._state.transfer_function
        # Otherwise the first one would look chosen.
        self.list.setCurrentRow(tfs.index(present) if present in tfs else -1)

    def _fill(self) -> None:
        self._listed = self.listed()
        self.list.clear()
        for preset in self._listed:
            item = QListWidgetItem(picture_icon(None, PICTURE), preset.name, self.list)
            item.setToolTip(preset.explanation)
            item.setTextAlignment(Qt.AlignmentFlag.AlignHCenter)
        rows = -(-len(self._listed) // COLUMNS)
        bar, policy = self.list.verticalScrollBar(), Qt.ScrollBarPolicy
        scrolls = rows > MOST_ROWS
        self.list.setVerticalScrollBarPolicy(
            policy.ScrollBarAlwaysOn if scrolls else policy.ScrollBarAlwaysOff
        )
        width = COLUMNS * CELL.width() + ROOM + (bar.sizeHint().width() if scrolls else 0)
        self.list.setFixedSize(width, min(rows, MOST_ROWS) * CELL.height() + ROOM)
        self.picturesWanted.emit(self._listed)


SWATCH = QSize(30, 14)

_LEAST_SHARE = 1e-6  # smallest range that can be typed, as a fraction of the volume's
PERCENTILES = {".1 to 99.9 % of the voxels": (0.1, 99.9), "1 to 99 % of the voxels": (1.0, 99.0)}


class RangePopup(QFrame):
    """Shows the range of the state's TF; each typed number is an undo step."""

    def __init__(self, state: ViewerState, layer: RangeLayer, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setProperty("role", "panel")
        self._state = state
        self._layer = layer
        self._data_range: Range = (0.0, 1.0)
        self.low, self.high = NumberBox(), NumberBox()
        self._hint = label("", "dim")
        form = QFormLayout(self)
        form.addRow("From", self.low)
        form.addRow("to", self.high)
        form.addRow(self._hint)
        self.low.valueChanged.connect(lambda low: self._typed((low, state.scalar_range[1])))
        self.high.valueChanged.connect(lambda high: self._typed((state.scalar_range[0], high)))
        state.tf_input.changed.connect(self._refresh)
        for box in (self.low, self.high):
            box.lineEdit().returnPressed.connect(self.close)

    def open_at(self, point: QPoint, data_range: Range) -> None:
        """Open at a point of the screen, for a volume with these values."""
        self._data_range = data_range
        low, high = values_at(data_range, self._state.scale)
        self._hint.setText(f"Values of the volume: {significant(low, 5)} to {significant(high, 5)}")
        self._refresh()
        self.move(point)
        self.show()
        self.low.setFocus()
        self.low.selectAll()

    def _refresh(self) -> None:
        if self.isHidden() and not self._hint.text():
            return
        lo, hi = self._state.scalar_range
        first, last = min(self._data_range[0], lo), max(self._data_range[1], hi)
        span = last - first
        least = _LEAST_SHARE * (self._data_range[1] - self._data_range[0])
        # A range wider than the data is allowed, as several volumes may share a TF.
        scale = self._state.scale
        self.low.set_limits(first - span, max(hi - least, lo), scale)
        self.high.set_limits(min(lo + least, hi), last + span, scale)
        self.low.show_value(lo)
        self.high.show_value(hi)

    def _typed(self, scalar_range: Range) -> None:
        if scalar_range[0] < scalar_range[1]:
            self._layer.set_range(scalar_range)
        self._refresh()


class TransferFunctionMenu(QObject):
    """Buttons with the menus that change a TF as a whole: presets, colours and the rest."""

    scale_wanted = Signal(str)  # with the scale that the user chose for the volume

    is_narrow = Painted(False, "show_colors")  # whether the colours' button is shown

    def __init__(
        self, area: PlotArea, layer: RangeLayer, moves: HandleMoves, parent: QWidget
    ) -> None:
        super().__init__(parent)
        self._area, self._layer, self._moves = area, layer, moves
        self._state = state = moves.state
        tip = "Range, axis and kind of the transfer function"
        self.button = IconButton("more", "More", tip=tip)
        self.menu = QMenu(self.button)
        show_tips(self.menu)
        tip = "Transfer functions to start from, with pictures of this volume"
        self.presets_button = _menu_button("Presets", "Presets ▾", tip)
        self.presets = PresetMenu(state, area, self.presets_button)
        self.presets.chosen.connect(lambda it: self._set(it.tf, f"preset {it.name}"))
        self.colors_button = _menu_button("Colour map", "▾", "Colours of the transfer function")
        self.colors_button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.colors_menu = QMenu(self.colors_button)
        for button, menu in (
            (self.button, self.menu),
            (self.presets_button, self.presets),
            (self.colors_button, self.colors_menu),
        ):
            button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
            button.setMenu(menu)
        self.popup = RangePopup(state, layer, parent)
        self._fill()
        self.menu.aboutToShow.connect(self._refresh)
        self.show_colors()

    def show_colors(self) -> None:
        """Show the present colours on their button."""
        size, color = QSize(40 if self.is_narrow else 64, 10), self._state.transfer_function.color
        self.colors_button.setIconSize(size)
        shown = np.linspace(*color.scalar_range, size.width())
        self.colors_button.setIcon(_swatch(color(shown), size))

    def _fill(self) -> None:
        self.colors_menu.setStyleSheet(f"QMenu {{ icon-size: {SWATCH.width()}px; }}")
        # Filled when first opened, as importing colour maps takes time.
        self.colors_menu.aboutToShow.connect(self._fill_colors)
        self._as_curve = add_action(self.menu, "As free curve", self.to_curve)
        self._as_modes = add_action(self.menu, "As modes", self.to_modes)
        add_action(self.menu, "New empty curve", self.start_curve)
        self.menu.addSeparator()
        self._add_range_menu()
        self._add_axis_menu()
        self.menu.addSeparator()
        tip = "A colour stop at the mean of a mode moves with the mode"
        switch = partial(setattr, self._moves, "colors_follow")
        follow = add_switch(self.menu, "Colours follow their mode", tip, switch)
        follow.setChecked(self._moves.colors_follow)

    def _add_range_menu(self) -> None:
        menu = self.menu.addMenu("Range")
        show_tips(menu)
        add_action(menu, "Type…", self.type_range)
        for text, (lower, upper) in PERCENTILES.items():
            action = add_action(menu, text, partial(self.set_percentiles, lower, upper))
            action.setToolTip("Ignore a few outliers")
        add_action(menu, "Fit to data", self.fit_to_data)

    def _add_axis_menu(self) -> None:
        menu = self.menu.addMenu("Axis")
        show_tips(menu)
        add_action(menu, "Show all", self._area.show_all).setToolTip(
            "Ctrl and the wheel zoom the axis, a drag with the middle button pans it"
        )
        add_action(menu, "Show range", partial(self._layer.show_range, True))
        self._scale = add_switch(
            menu,
            "Logarithmic scale",
            "TF, histogram and curve over the logarithm of the values. Values of zero or below "
            "look like the lowest one.",
            lambda on: self.scale_wanted.emit("log" if on else "linear"),
        )
        self._logarithmic = add_switch(
            menu,
            "Logarithmic plot",
            "Spacing of the values in the plot; the image stays the same",
            self.set_logarithmic,
        )
        self._fine = add_switch(
            menu,
            "Logarithmic opacity",
            "More room for opacities below .1",
            lambda on: self._area.set_scale(OpacityScale(on)),
        )

    def show_scales(self) -> None:
        """Check the plot's scales in the menu; the volume may have changed."""
        self._scale.setChecked(self._area.axis.labels == "log")
        self._logarithmic.setChecked(self._area.axis.scale != "linear")
        self._fine.setChecked(self._area.scale.logarithmic)

    def _refresh(self) -> None:
        # The choice may have been refused.
        self.show_scales()
        opacity = self._state.transfer_function.opacity
        self._as_curve.setEnabled(not opacity.points)
        self._as_modes.setEnabled(bool(opacity.points))
        is_log = self._area.axis.labels == "log"
        self._scale.setEnabled(is_log or self._area.data_range[1] > 0)
        self._logarithmic.setEnabled(not is_log)

    def _fill_colors(self) -> None:
        if not self.colors_menu.isEmpty():
            return
        for name in COLOR_MAPS:
            action = add_action(self.colors_menu, name, partial(self.use_color_map, name))
            action.setIcon(_swatch(map_colors(name, SWATCH.width()), SWATCH))
        self.colors_menu.addSeparator()
        add_action(self.colors_menu, "Reverse the colours", self.reverse_colors)

    def use_color_map(self, name: str) -> None:
        """Replace the colours by a map's: one undo step."""
        self._change(f"colours {name}", color=color_tf_of_map(name, self._state.scalar_range))

    def reverse_colors(self) -> None:
        """Mirror the colours in the range: one undo step."""
        self._change("reverse colours", color=reversed_colors(self._state.transfer_function.color))

    def to_curve(self) -> None:
        """Turn modes into a free curve of few points: one undo step."""
        self._change("as free curve", opacity=as_curve(self._state.transfer_function.opacity))

    def to_modes(self) -> None:
        """Turn a free curve into modes: one undo step."""
        self._change("as modes", opacity=fitted_modes(self._state.transfer_function.opacity))

    def start_curve(self) -> None:
        """Begin with a free curve of zero opacity: one undo step."""
        opacity, (lo, hi) = self._state.transfer_function.opacity, self._state.scalar_range
        self._change("new curve", opacity=replace(opacity, modes=(), points=((lo, 0.0), (hi, 0.0))))

    def type_range(self) -> None:
        """Open the popup with the range's two numbers."""
        below = self.button.mapToGlobal(QPoint(0, self.button.height()))
        self.popup.open_at(below, self._area.data_range)

    def set_percentiles(self, lower: float, upper: float) -> None:
        """Set the range to the interval between two percentiles of the voxels."""
        histogram = self._area.histogram
        self._set_range(percentile_range(histogram.counts, histogram.edges, lower, upper))

    def fit_to_data(self) -> None:
        """Set the range to the smallest and largest voxel."""
        self._set_range(self._area.data_range)

    def set_logarithmic(self, logarithmic: bool) -> None:
        """Show the values on a logarithmic or a linear scale."""
        axis = self._area.axis
        self._area.set_axis(ScalarAxis.over(axis.full, logarithmic, axis.labels, axis.numbers))

    def _set_range(self, scalar_range: Range) -> None:
        self._layer.set_range(scalar_range)
        self._layer.show_range()

    def _change(self, text: str, **part: Any) -> None:
        self._set(replace(self._state.transfer_function, **part), text)

    def _set(self, tf: TransferFunction, text: str) -> None:
        if tf != self._state.transfer_function:
            self._state.tf_input.exchange(tf, text)


def _menu_button(name: str, text: str, tip: str) -> QToolButton:
    button = named(text_button(text, tip, role="flat"), name)
    button.setFixedHeight(BUTTON)
    return button


def _swatch(colors: NDArray[np.floating], size: QSize) -> QIcon:
    """Picture of colours (width, 3)."""
    row = np.rint(colors * 255).astype(np.uint8)
    pixels = np.ascontiguousarray(np.broadcast_to(row, (size.height(), *row.shape)))
    image = QImage(
        pixels.data, size.width(), size.height(), 3 * size.width(), QImage.Format.Format_RGB888
    )
    # A copy, as QImage does not own the array.
    return QIcon(QPixmap.fromImage(image.copy()))
