"""The open volume over another range, on another scale, with or without its missing voxels."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.volume_opening import VolumeOpening
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import ValueScale
from model.scene.volume import Volume


class VolumeRanging(QObject):
    """Computes in the background what the open volume is over another range; the newest counts.

    Parameters
    ----------
    read_volume : callable
        Reads a volume of a path.
    preferences : Preferences
        They keep whether missing voxels are drawn.
    """

    taken = Signal(object)
    """Emitted with the :class:`OpenedVolume`."""
    failed = Signal(str)
    """Emitted with an error sentence."""

    def __init__(
        self,
        read_volume: Callable[..., Volume],
        preferences: Preferences,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._preferences = preferences
        self._opening = VolumeOpening(read_volume, self)
        self._opened: OpenedVolume | None = None

    @property
    def has_missing(self) -> bool:
        """Whether the volume has missing voxels."""
        return self._opened is not None and self._opened.has_missing

    @property
    def draws_missing(self) -> bool:
        """Whether the volume's missing voxels are drawn."""
        return self._opened is not None and self._opened.volume.draws_missing

    @property
    def is_busy(self) -> bool:
        """True while something is computed that is still wanted."""
        return self._opening.is_busy

    def start(self, opened: OpenedVolume) -> None:
        """Go on from another volume; what is on its way is discarded."""
        self._opening.abandon()
        self._opened = opened

    def follow(self, transfer_function: TransferFunction) -> None:
        """Show the volume over the TF's range and scale once these have been changed."""
        self._opening.abandon()
        self.show_over(transfer_function.scalar_range, transfer_function.scale)

    def show_over(self, scalar_range: Range, scale: ValueScale) -> None:
        """Show the volume over another range and scale."""
        opened = self._opened
        if opened is None:
            return
        if (scalar_range, scale) != (opened.volume.scalar_range, opened.volume.scale):
            self._opening.show_over(opened, scalar_range, scale, self._take, self.failed.emit)

    def show_on_scale(self, scale: ValueScale) -> None:
        """Show the volume on another scale, under its default TF: one undo step."""
        if self._opened is not None and scale != self._opened.volume.scale:
            self._opening.show_on_scale(self._opened, scale, self._take, self.failed.emit)

    def draw_missing(self, drawn: bool) -> None:
        """Draw the volume's missing voxels, or leave them transparent, as at first."""
        opened = self._opened
        if opened is not None and opened.has_missing and drawn != self.draws_missing:
            self._preferences.note_volume(opened.fingerprint, draws_missing=drawn)
            self._opening.draw_missing(opened, drawn, self._take, self.failed.emit)

    def abandon(self) -> None:
        """Discard what is on its way."""
        self._opening.abandon()

    def join(self) -> None:
        """Wait until all threads have ended."""
        self._opening.join()

    def _take(self, opened: OpenedVolume) -> None:
        self._opened = opened
        self.taken.emit(opened)
