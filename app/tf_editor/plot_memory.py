"""Keeping of how each volume's values and opacities are spread over the TF's plot."""

from __future__ import annotations

from PySide6.QtCore import QObject

from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.unit_axis import OpacityScale, ScalarAxis


class PlotMemory(QObject):
    """Keeps the plot's scales, and the values in sight, for the next time."""

    def __init__(self, area: PlotArea, preferences: Preferences) -> None:
        super().__init__(area)
        self._area = area
        self._preferences = preferences
        self._fingerprint = ""
        self._opening = ""
        self._series: object = None
        area.axisChanged.connect(self._note)

    def start(self, opened: OpenedVolume) -> None:
        """Take another volume's scales, before it is shown; the next time step keeps them."""
        self._fingerprint, self._opening = "", opened.fingerprint
        before, self._series = self._series, opened.volume.series
        known = self._preferences.volume(opened.fingerprint)
        if before == self._series and known.visible is None:
            return
        self._area.set_scale(OpacityScale(known.opacity_scale == "logarithmic"))
        self._area.set_axis(
            ScalarAxis.over(
                self._area.axis.full, known.value_scale == "logarithmic", opened.volume.scale
            )
        )

    def settle(self) -> None:
        """Bring the values into sight that were seen last, once the volume is shown."""
        visible = self._preferences.volume(self._opening).visible
        if visible is not None and visible[0] < visible[1]:
            self._area.set_axis(self._area.axis.showing(visible))
        self._fingerprint = self._opening

    def _note(self) -> None:
        if self._fingerprint:
            axis = self._area.axis
            self._preferences.note_volume(
                self._fingerprint,
                value_scale="linear" if axis.scale == "linear" else "logarithmic",
                opacity_scale="logarithmic" if self._area.scale.logarithmic else "linear",
                visible=(float(axis.visible[0]), float(axis.visible[1])),
            )
