"""The menu of TFs to begin with, each with a picture of the open volume."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from PySide6.QtCore import Signal
from PySide6.QtGui import QAction, QImage
from PySide6.QtWidgets import QMenu, QWidget

from app.controls import add_action, picture_icon
from app.menu_tips import show_tips
from app.state.viewer_state import ViewerState
from app.tf_editor.plot_area import PlotArea
from model.scene.range_fitting import fit_to_range
from model.scene.tf_presets import Preset, looks_like_hu, presets

PICTURE = 64
"""Sides of a picture, in pixels: all of them have room on a small screen."""


class PresetMenu(QMenu):
    """Lists presets over the volume's scalar range, and says which one is chosen.

    Parameters
    ----------
    area : PlotArea
        Has the histogram.
    """

    chosen = Signal(object)
    """Emitted with the chosen :class:`~model.scene.tf_presets.Preset`."""
    picturesWanted = Signal(object)
    """Emitted with a tuple of the presets listed, each time that the menu opens."""

    def __init__(self, state: ViewerState, area: PlotArea, parent: QWidget | None = None) -> None:
        super().__init__("Presets", parent)
        self._state = state
        self._area = area
        self._by_name: dict[str, QAction] = {}
        self.units = ""
        """Unit of the volume's scalars; may be empty."""
        show_tips(self)
        self.setStyleSheet(f"QMenu {{ icon-size: {PICTURE}px; }}")
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
        return default, *others

    def _fill(self) -> None:
        self.clear()
        self._by_name = {}
        listed = self.listed()
        for preset in listed:
            action = add_action(self, preset.name, partial(self.chosen.emit, preset))
            action.setToolTip(preset.explanation)
            action.setIcon(picture_icon(None, PICTURE))
            self._by_name[preset.name] = action
        self.picturesWanted.emit(listed)

    def set_pictures(self, pictures: Mapping[str, QImage]) -> None:
        """Show how the volume looks under each preset, by name."""
        for name, picture in pictures.items():
            if name in self._by_name:
                self._by_name[name].setIcon(picture_icon(picture, PICTURE))
