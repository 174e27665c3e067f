"""Says in the status line which keys and gestures are of use under the mouse."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from app.state.sensitivity_state import SensitivityState
from app.window.gesture_table import status_keys
from app.window.status_line import StatusLine

FILES = "Files"
IMAGES, DRAWING, REGIONS, MAP = "Images", "Drawing a region", "Regions", "Map of TFs (B)"
PLOT, VALUE = "Transfer function", "Value under the mouse"
PANEL = "Values and edits"


class KeyHints(QObject):
    """Gives the areas of the window their status tips, and follows what is under way.

    Parameters
    ----------
    regions : SensitivityState
        With a region the images have other gestures, and with a band of values the plot.
    """

    def __init__(
        self,
        status: StatusLine,
        regions: SensitivityState,
        images: Sequence[QWidget],
        maps: Sequence[QWidget],
        plot: QWidget,
        panel: QWidget,
    ) -> None:
        super().__init__(status)
        self._status, self._regions = status, regions
        self._images, self._plot = images, plot
        self._is_empty = True
        for each in maps:
            each.setStatusTip(status_keys(MAP))
        panel.setStatusTip(status_keys(PANEL))
        for changed in (regions.regionsChanged, regions.bandChanged, regions.toolChanged):
            changed.connect(lambda *_: self._follow())
        self._follow()
        self.show("")

    def show(self, keys: str) -> None:
        """Show the keys of what is under the mouse; of nothing, those of the images."""
        self._status.set_keys(keys or self._of_images())

    def start_volume(self) -> None:
        """Tell what can be done with images and plot, now that there is something in them."""
        self._is_empty = False
        self._follow()

    def _of_images(self) -> str:
        if self._is_empty:
            return status_keys(FILES)
        if self._regions.tool is not None:
            return status_keys(DRAWING)
        return status_keys(IMAGES if self._regions.active is None else REGIONS)

    def _follow(self) -> None:
        """Give images and plot the keys of what is under way."""
        shown, band = self._status.keys, self._regions.band
        plot = status_keys(PLOT if band is None else VALUE)
        if self._is_empty:
            plot = ""
        for widget, keys in (
            *((image, self._of_images()) for image in self._images),
            (self._plot, plot),
        ):
            if shown and shown == widget.statusTip():
                # The mouse is there, and does not come anew.
                self._status.set_keys(keys)
            widget.setStatusTip(keys)
