"""What the three slices show together: a volume, the cross-hair, colours, and a band of values."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from model.scene.crop import CropBox, least_length
from model.scene.slices import (
    MIDDLE,
    Plane,
    SliceColors,
    SlicePaint,
    place_at,
    planes_of,
    voxel_of,
)
from model.scene.transfer_function import Range, TransferFunction
from model.scene.volume import Triple, Volume


class SliceState(QObject):
    """The shared state of the slices; places are in fractions of the volume's extent."""

    changed = Signal(str)  # emitted with "volume", "place", "colors" or "crop"
    hovered = Signal(object)  # emitted with the place under the mouse; None when it leaves

    def __init__(self, tf: Callable[[], TransferFunction], parent: QObject) -> None:
        super().__init__(parent)
        self._tf = tf
        self.volume: Volume | None = None
        self.planes = planes_of("+z")
        self.place: Triple = MIDDLE
        self.colors: SliceColors = "gray"
        self.window: Range = (0.0, 1.0)
        self.smooth = True
        self.band: Range | None = None
        self.crop: CropBox | None = None
        self.edits_crop = False
        """Whether the crop box has handles."""
        self._paint: SlicePaint | None = None

    @property
    def paint(self) -> SlicePaint:
        """Colours of the values, for the present TF."""
        if self._paint is None:
            self._paint = SlicePaint.of(self.colors, self.window, self._tf())
        return self._paint

    def show_volume(self, volume: Volume, window: Range, up: str, place: Triple) -> None:
        """Show a volume in a window of gray: level slices are across the axis that points up."""
        if self.volume is None or self.volume.scalar_range != volume.scalar_range:
            self.window = window
        if volume.file.is_labels and not (self.volume and self.volume.file.is_labels):
            # Gray says nothing about labels.
            self.colors = "colors"
        self.volume, self.planes, self.place = volume, planes_of(up, volume.axis_labels), place
        self._paint = None
        self.changed.emit("volume")

    def move(self, place: Triple) -> None:
        """Put the cross-hair onto the voxel nearest to a place."""
        if self.volume is not None:
            place = place_at(self.volume, voxel_of(self.volume, place))
            if place != self.place:
                self.place = place
                self.changed.emit("place")

    def scroll(self, plane: Plane, steps: int) -> None:
        """Go on by some slices, which are in the way that their axis points."""
        if self.volume is not None:
            x, y, z = voxel_of(self.volume, self.place)
            voxel = [x, y, z]
            voxel[plane.axis] += steps
            self.move(place_at(self.volume, (voxel[0], voxel[1], voxel[2])))

    def recolor(self, colors: SliceColors | None = None) -> None:
        """Show other colours, or the same ones of another TF."""
        self.colors = colors or self.colors
        self._paint = None
        self.changed.emit("colors")

    def set_window(self, window: Range) -> None:
        """Show other values as gray, from black to white."""
        self.window = window
        self.recolor()

    def outline(self, band: Range | None) -> None:
        """Outline a band of values, or none."""
        if band != self.band:
            self.band = band
            self.changed.emit("colors")

    def show_crop(self, crop: CropBox | None, edits: bool) -> None:
        """Draw a crop box, with handles or without."""
        self.crop, self.edits_crop = crop, edits
        self.changed.emit("crop")

    def cropped(self, plane: Plane, low: tuple[float, float], high: tuple[float, float]) -> CropBox:
        """Return the crop box with a rectangle of a slice's picture, of its corners' fractions."""
        assert self.volume is not None
        box = self.crop or CropBox()
        ends = plane.moved(MIDDLE, low), plane.moved(MIDDLE, high)
        for axis in (plane.right[0], plane.up[0]):
            least = least_length(self.volume.dimensions[axis])
            first, last = sorted(end[axis] for end in ends)
            if first != box.low[axis]:
                box = box.with_plane(axis, 0, first, least)
            if last != box.high[axis]:
                box = box.with_plane(axis, 1, last, least)
        return box
