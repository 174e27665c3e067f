"""The column of slices: three of them or a large one, and below what is under the mouse."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.caption_button import CaptionButton
from app.controls import ElidedLabel, add_action, add_choices, fill
from app.number_box import significant
from app.slices.slice_state import SliceState
from app.slices.slice_view import SliceView
from app.state.viewer_state import ViewerState
from model.scene.slices import SliceColors, coordinates, stored_at, voxel_of
from model.scene.volume import Triple

COLORS: dict[SliceColors, tuple[str, str]] = {
    "gray": ("Gray", "Drag with the right button to change its window"),
    "colors": ("Colours", "The TF's colours"),
    "overlay": ("Gray and TF", "The TF's colours over gray, as opaque as the TF has them"),
}
DIGITS = 5  # of a coordinate; values have all that single precision tells apart


class SlicesColumn(QWidget):
    """Shows three slices; a double click makes one of them large."""

    def __init__(
        self, state: SliceState, viewer: ViewerState, resized: Callable[[bool], object]
    ) -> None:
        super().__init__()
        self.state, self._viewer, self._resized = state, viewer, resized
        crop = viewer.crop_input
        drag = crop.move, lambda: crop.finish()
        self.views = [SliceView(state, number, drag, self._enlarge) for number in range(3)]
        self.button = CaptionButton()
        menu = self.button.add_menu()
        self._choices = add_choices(menu, COLORS, state.recolor)
        menu.addSeparator()
        add_action(menu, "&Full range of gray", self._reset_gray)
        add_action(menu, "&Show all of the slices", self._fit)
        self.value, self.where = ElidedLabel(), ElidedLabel()
        self.where.setProperty("role", "dim")
        words = fill(QVBoxLayout(), self.value, self.where)
        foot = fill(QHBoxLayout(), self.button, margins=(4, 2, 6, 2), spacing=6)
        foot.addLayout(words, 1)
        column = fill(QVBoxLayout(self), spacing=1)
        for view in self.views:
            column.addWidget(view, 1)
        column.addLayout(foot)
        state.changed.connect(self._follow)
        state.hovered.connect(self._say)
        self._follow("volume")

    @property
    def large(self) -> SliceView | None:
        """The slice that is shown alone; None while all are."""
        shown = [view for view in self.views if not view.isHidden()]
        return shown[0] if len(shown) == 1 else None

    @property
    def readout(self) -> str:
        """What is under the mouse, or at the cross-hair."""
        return f"{self.value.full_text}\n{self.where.full_text}"

    def _enlarge(self, view: SliceView) -> None:
        is_large = self.large is None
        for each in self.views:
            each.setVisible(each is view or not is_large)
        self._resized(is_large)

    def _follow(self, what: str) -> None:
        state = self.state
        for view in self.views:
            if what == "volume":
                view.show_volume()
            elif what == "crop":
                view.show_crop()
            else:
                view.show_slice()
        if what in ("volume", "colors"):
            self._choices[state.colors].setChecked(True)
            self.button.set_title(COLORS[state.colors][0])
        self._say(None)

    def _reset_gray(self) -> None:
        volume = self.state.volume
        if volume is not None:
            self.state.set_window(volume.scalar_range)

    def _fit(self) -> None:
        for view in self.views:
            view.fit()

    def _say(self, place: Triple | None) -> None:
        """Say value and place under the mouse; without one, those at the cross-hair."""
        volume = self.state.volume
        if volume is None:
            return
        place = place or self.state.place
        value = stored_at(volume, place)
        said = "nothing measured" if value is None else f"{value:.9g} {volume.units}".rstrip()
        name = "" if value is None else self._viewer.label_name(value)
        voxel = ", ".join(map(str, voxel_of(volume, place)))
        self.value.set_full_text(f"{said}  {name}".rstrip() + f"   voxel {voxel}")
        numbers = [f"{axis} {significant(at, DIGITS)}" for axis, at in coordinates(volume, place)]
        self.where.set_full_text("  ".join([*numbers, volume.file.spacing_unit]).rstrip())
