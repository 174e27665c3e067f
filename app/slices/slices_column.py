"""The column of slices: three of them or a large one, and below what is under the mouse."""

from __future__ import annotations

import math
from collections.abc import Callable

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.caption_button import CaptionButton
from app.controls import ElidedLabel, add_action, add_choices, fill
from app.number_box import significant
from app.slices.slice_view import SliceState, SliceView
from app.state.viewer_state import ViewerState
from model.scene.slices import SliceColors, coordinates, stored_at, voxel_of
from model.scene.volume import Triple

COLORS: dict[SliceColors, tuple[str, str]] = {
    "gray": ("Gray", "Drag with the right button to change its window"),
    "colors": ("TF", "The TF's colours"),
    "overlay": ("Overlay", "The TF's colours over gray, as opaque as the TF has them"),
}
LEAST_DIGITS = 4  # of a coordinate


class SlicesColumn(QWidget):
    """Shows three slices; a double click makes one of them large."""

    def __init__(self, viewer: ViewerState, resized: Callable[[], object]) -> None:
        super().__init__()
        self.state, self._viewer, self._resized = SliceState(self), viewer, resized
        self._under: Triple | None = None
        state, crop = self.state, viewer.crop_input
        self.views = [SliceView(state, number, crop, self._enlarge) for number in range(3)]
        self.button = CaptionButton()
        menu = self.button.add_menu()
        self.choices = add_choices(menu, COLORS, lambda colors: state.show(colors=colors))
        menu.addSeparator()
        add_action(menu, "Gray of &all values", self._reset_gray)
        self.value, self.where = ElidedLabel(), ElidedLabel()
        self.where.setProperty("role", "dim")
        foot = fill(QHBoxLayout(), self.button, margins=(4, 2, 6, 2), spacing=6)
        foot.addLayout(fill(QVBoxLayout(), self.value, self.where), 1)
        column = fill(QVBoxLayout(self), spacing=1)
        for view in self.views:
            column.addWidget(view, 1)
        column.addLayout(foot)
        state.changed.connect(self._refresh)
        state.hovered.connect(self._say)

    @property
    def is_large(self) -> bool:
        """Whether one slice is shown alone."""
        return any(view.isHidden() for view in self.views)

    def _enlarge(self, view: SliceView) -> None:
        was_large = self.is_large
        for each in self.views:
            each.setVisible(was_large or each is view)
        self._resized()

    def _refresh(self) -> None:
        for view in self.views:
            view.refresh()
        self.choices[self.state.colors].setChecked(True)
        self.button.set_title(COLORS[self.state.colors][0])
        self._say(self._under)

    def _reset_gray(self) -> None:
        if self.state.volume is not None:
            self.state.show(window=self.state.volume.scalar_range)

    def _say(self, place: Triple | None) -> None:
        """Say value and place under the mouse; without one, those at the cross-hair."""
        volume = self.state.volume
        if volume is None:
            return
        self._under, place = place, place or self.state.place
        value = stored_at(volume, place)
        said = "nothing measured" if value is None else f"{value:.9g} {volume.units}".rstrip()
        name = "" if value is None else self._viewer.label_name(value)
        voxel = ", ".join(map(str, voxel_of(volume, place)))
        self.value.set_full_text("   ".join(filter(None, (said, name, f"voxel {voxel}"))))
        step, found = min(volume.spacing), coordinates(volume, place)
        numbers = [f"{axis} {_written(number, step)}" for axis, number in found]
        self.where.set_full_text("  ".join([*numbers, volume.file.spacing_unit]).rstrip())


def _written(coordinate: float, step: float) -> str:
    """Write a coordinate with so many digits that those of neighbouring voxels differ."""
    digits = 2 + int(math.log10(max(abs(coordinate) / step, 1)))
    return significant(coordinate, max(LEAST_DIGITS, digits))
