"""A card with the planes of the crop box, as sliders and as voxels."""

from __future__ import annotations

import math
from functools import partial

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QApplication,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)
from superqt import QDoubleRangeSlider

from app import theme
from app.icons import IconButton
from app.number_box import WholeNumberBox
from app.state.crop_planes import (
    WITHOUT_VOLUME,
    axis_name,
    least_length,
    place_of,
    voxel_at,
)
from app.state.viewer_state import ViewerState
from app.wheel_guard import WheelGuard
from model.scene.crop import CropBox

SLIDER_WIDTH = 180
"""Of a slider at least, in pixels."""

PADDING = 22
"""Width of a voxel's box next to its number, in pixels."""

SLIDER_TIP = "Drag an end, or the middle to move the slab"


class CropCard(QFrame):
    """Shows the state's crop box and changes it; initially hidden."""

    shownChanged = Signal(bool)
    """Emitted when the card is shown or hidden, other than with its window."""

    def __init__(self, state: ViewerState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self._dimensions = WITHOUT_VOLUME
        self.setProperty("role", "card")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.names = [QLabel() for _ in range(3)]
        self.sliders = [
            QDoubleRangeSlider(Qt.Orientation.Horizontal)  # type: ignore[no-untyped-call]
            for _ in range(3)
        ]
        self.planes = [(_voxel_box(), _voxel_box()) for _ in range(3)]
        self.whole = QPushButton("Whole volume")
        self.whole.setToolTip("Show all of the volume again")
        # After a click, keys such as W are the window's again.
        self.whole.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.whole.clicked.connect(lambda: state.crop_input.set(None))
        self.dismiss = IconButton(
            "close",
            "Close",
            "K",
            "Close this card; the volume stays cropped",
            colors=theme.ON_IMAGE,
        )
        self.dismiss.clicked.connect(lambda: self.set_shown(False))
        self._lay_out()
        state.crop_input.changed.connect(self._show)
        state.navigationChanged.connect(self._name)
        self.set_volume(WITHOUT_VOLUME)
        self.hide()

    @property
    def is_shown(self) -> bool:
        """Whether the card is there while its window is."""
        return not self.isHidden()

    def set_shown(self, shown: bool) -> None:
        """Show or hide the card; the crop box stays as it is."""
        focus = QApplication.focusWidget()
        if not shown and focus is not None and self.isAncestorOf(focus):
            # Otherwise the next number box would have it.
            self.window().setFocus()
        if shown != self.is_shown:
            for slider in self.sliders:
                # It does not see the mouse's release.
                slider.setSliderDown(False)
            self.setVisible(shown)
            self.shownChanged.emit(shown)

    def set_volume(self, dimensions: tuple[int, int, int]) -> None:
        """Set the number of voxels along x, y and z."""
        self._dimensions = dimensions
        for axis, count in enumerate(dimensions):
            # Its ends come no nearer to each other.
            self.sliders[axis].setSingleStep(least_length(count))
            for box in self.planes[axis]:
                box.set_limits(0, count - 1)
                box.setFixedWidth(box.fontMetrics().horizontalAdvance(f"{count}") + PADDING)
        self._name()
        self._show()

    def _lay_out(self) -> None:
        title = QLabel("Crop")
        title.setProperty("role", "title")
        head = QHBoxLayout()
        head.addWidget(title)
        head.addStretch()
        head.addWidget(self.whole)
        head.addWidget(self.dismiss)
        rows = QGridLayout()
        rows.setHorizontalSpacing(8)
        rows.setVerticalSpacing(4)
        rows.setColumnStretch(2, 1)
        for axis, (first, last) in enumerate(self.planes):
            slider = self.sliders[axis]
            slider.setToolTip(SLIDER_TIP)
            slider.setMinimumWidth(SLIDER_WIDTH)
            slider.setRange(0.0, 1.0)
            # The keys' way are the numbers next to it.
            slider.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            WheelGuard(slider)
            for column, widget in enumerate((self.names[axis], first, slider, last)):
                rows.addWidget(widget, axis, column)
            slider.valueChanged.connect(partial(self._drag, axis))
            slider.sliderReleased.connect(self._state.crop_input.finish)
            for side, box in enumerate((first, last)):
                box.valueChanged.connect(partial(self._type, axis, side))
        column_of_all = QVBoxLayout(self)
        column_of_all.setContentsMargins(12, 6, 8, 8)
        column_of_all.setSpacing(4)
        column_of_all.addLayout(head)
        column_of_all.addLayout(rows)

    def _name(self) -> None:
        for axis, count in enumerate(self._dimensions):
            name = axis_name(axis, self._state.axis_labels)
            self.names[axis].setText(name)
            self.sliders[axis].setAccessibleName(f"Shown part along {name}")
            for end, box in zip(("First", "Last"), self.planes[axis], strict=True):
                meaning = f"{end} voxel along {name}"
                box.setAccessibleName(meaning)
                box.setToolTip(f"{meaning}\nVoxels are numbered from 0 to {count - 1}")

    def _show(self) -> None:
        crop = self._state.crop or CropBox()
        self.whole.setEnabled(self._state.crop is not None)
        for axis, count in enumerate(self._dimensions):
            span = crop.low[axis], crop.high[axis]
            with QSignalBlocker(self.sliders[axis]):
                self.sliders[axis].setValue(span)
            first, last = (voxel_at(place, count) for place in span)
            apart = math.ceil(least_length(count) * (count - 1) - 1e-9)
            self.planes[axis][0].set_limits(0, max(last - apart, first))
            self.planes[axis][1].set_limits(min(first + apart, last), count - 1)
            for box, voxel in zip(self.planes[axis], (first, last), strict=True):
                box.show_value(voxel)

    def _drag(self, axis: int, span: tuple[float, float]) -> None:
        crop = self._state.crop or CropBox()
        self._state.crop_input.move(crop.with_span(axis, *span))

    def _type(self, axis: int, side: int, voxel: int) -> None:
        crop, count = self._state.crop or CropBox(), self._dimensions[axis]
        place, least = place_of(voxel, count), least_length(count)
        self._state.crop_input.set(crop.with_plane(axis, side, place, least))
        self._show()


def _voxel_box() -> WholeNumberBox:
    """A box for the number of a voxel; typed numbers apply on Enter or focus loss."""
    box = WholeNumberBox()
    box.setKeyboardTracking(False)
    box.setAlignment(Qt.AlignmentFlag.AlignRight)
    return box
