"""The popover of TFs to begin with, each with a picture of the open volume."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QImage, QShowEvent
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QMenu, QWidget, QWidgetAction

from app.controls import picture_icon
from app.menu_tips import show_tips
from app.state.viewer_state import ViewerState
from app.tf_editor.plot_area import PlotArea
from model.scene.ranges import fit_to_range
from model.scene.tf_presets import Preset, looks_like_hu, presets

PICTURE = 96
"""Sides of a picture, in pixels."""

CELL = QSize(118, 128)
"""Room of a picture with its name."""

ROOM = 8
"""Around all pictures, in pixels."""

COLUMNS, MOST_ROWS = 4, 3
"""Pictures in a row, and rows that are seen at once: all have room on a small screen."""


class PresetMenu(QMenu):
    """Shows presets over the volume's scalar range, and says which one is chosen.

    Attributes
    ----------
    own : callable
        Returns the user's own presets, which follow the others.
    """

    chosen = Signal(object)
    """Emitted with the chosen :class:`~model.scene.tf_presets.Preset`."""
    picturesWanted = Signal(object)
    """Emitted with a tuple of the presets listed, each time that the menu opens."""

    def __init__(self, state: ViewerState, area: PlotArea, parent: QWidget | None = None) -> None:
        super().__init__("Presets", parent)
        self._state, self._area = state, area
        self._listed: tuple[Preset, ...] = ()
        self.own: Callable[[], Sequence[Preset]] = tuple
        self.units = ""
        """Unit of the volume's scalars; may be empty."""
        self.list = QListWidget()
        self.list.setAccessibleName("Presets")
        self.list.setViewMode(QListWidget.ViewMode.IconMode)
        self.list.setMovement(QListWidget.Movement.Static)
        self.list.setIconSize(QSize(PICTURE, PICTURE))
        self.list.setGridSize(CELL)
        self.list.setWordWrap(True)
        self.list.setFrameShape(QListWidget.Shape.NoFrame)
        self.list.viewport().setAutoFillBackground(False)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        # A click and Enter, not each of the arrow keys, take one.
        self.list.itemClicked.connect(self.take)
        self.list.itemActivated.connect(self.take)
        action = QWidgetAction(self)
        action.setDefaultWidget(self.list)
        self.addAction(action)
        show_tips(self)
        self.aboutToShow.connect(self._fill)

    def listed(self) -> tuple[Preset, ...]:
        """Return the presets of the volume, the default one first."""
        histogram = self._area.histogram
        scalar_range = self._state.scalar_range
        default = Preset(
            "Default",
            "Three modes, by the volume's histogram",
            # Like the others it leaves the range as it is.
            fit_to_range(self._state.default_transfer_function, scalar_range),
        )
        others = presets(
            scalar_range,
            histogram.counts,
            histogram.edges,
            self.units,
            self._state.scale,
            # Of the whole volume, so that the order stays whatever range is shown.
            bool(self._state.axis_labels) or looks_like_hu(self._area.data_range, self.units),
        )
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
        """Let the arrow keys choose among the pictures."""
        super().showEvent(event)
        self.list.setFocus()

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
