"""A compact bar above the reference image: light, quality, and what draws it."""

from __future__ import annotations

from functools import partial
from typing import Any

from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QHBoxLayout, QMenu, QToolButton, QWidget

from app.controls import add_action
from app.engines.engines import ReferenceSettings
from app.image_view.light_ball import LightBall
from app.state.reference_choices import ReferenceChoices
from app.state.reference_work import ReferenceWork
from app.state.viewer_state import ViewerState

LIGHTINGS = {
    "auto": "Automatic: as the model, else direct",
    "none": "None",
    "direct": "Direct: shaded surfaces",
    "global": "Global: with shadows",
}

SHORT_LIGHTINGS = {"none": "none", "direct": "direct", "global": "global"}

DISTANCES = {
    None: "Automatic: as the model, else 0.5 voxels",
    1.0: "1 voxel: fast",
    0.5: "0.5 voxels",
    0.25: "0.25 voxels: fine",
}

SIZES = {
    "pane": "As the window",
    "generator": "Same size as the generator",
    256: "256 × 256",
    512: "512 × 512",
    1024: "1024 × 1024",
    2048: "2048 × 2048",
}

DRAWINGS = {
    "auto": "Ray caster while moving, VTK at rest",
    "vtk": "VTK alone",
    "raycast": "Ray caster alone",
}

SHORT_DRAWINGS = {"auto": "both", "vtk": "VTK", "raycast": "ray caster"}


class ReferenceBar(QWidget):
    """Shows and changes how the reference image is drawn.

    Parameters
    ----------
    state : ViewerState
    work : ReferenceWork
    """

    def __init__(
        self, state: ViewerState, work: ReferenceWork, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._work = work
        self._actions: dict[str, dict[Any, Any]] = {}
        self.ball = LightBall(state)
        self.light = self._button("Light of the reference image")
        self.quality = self._button("Sample distance and size of the reference image")
        self.drawing = self._button("What draws the reference image")
        self.quality.setText("Quality")
        self.fill_light(self._menu_of(self.light))
        self.fill_quality(self._menu_of(self.quality))
        self.fill_drawing(self._menu_of(self.drawing))
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(4)
        for widget in (self.light, self.ball, self.quality, self.drawing):
            row.addWidget(widget)
        work.choicesChanged.connect(self._show_choices)
        work.settingsChanged.connect(self._show_settings)
        work.lightRangeChanged.connect(self.ball.set_range)
        self._show_choices(work.choices)
        self._show_settings(work.settings)

    def fill_light(self, menu: QMenu) -> None:
        """Add the kinds of light to a menu."""
        self._add_choices(menu, "lighting", LIGHTINGS)

    def fill_quality(self, menu: QMenu) -> None:
        """Add sample distances and sizes to a menu."""
        menu.addSection("Sample distance")
        self._add_choices(menu, "sample_distance", DISTANCES)
        menu.addSection("Size")
        self._add_choices(menu, "size", SIZES)

    def fill_drawing(self, menu: QMenu) -> None:
        """Add the renderers to a menu."""
        self._add_choices(menu, "drawing", DRAWINGS)

    def _add_choices(self, menu: QMenu, name: str, texts: dict[Any, str]) -> None:
        group = QActionGroup(menu)
        actions = self._actions.setdefault(name, {})
        for choice, text in texts.items():
            action = add_action(menu, text, partial(self._choose, name, choice))
            action.setCheckable(True)
            action.setChecked(choice == getattr(self._work.choices, name))
            group.addAction(action)
            actions.setdefault(choice, []).append(action)

    def _choose(self, name: str, choice: Any) -> None:
        self._work.choose(**{name: choice})

    def _show_choices(self, choices: ReferenceChoices) -> None:
        for name, actions in self._actions.items():
            for action in actions.get(getattr(choices, name), ()):
                action.setChecked(True)
        self.drawing.setText(f"By {SHORT_DRAWINGS[choices.drawing]}")
        self._show_settings(self._work.settings)

    def _show_settings(self, settings: ReferenceSettings) -> None:
        by_itself = ""
        if self._work.choices.lighting == "auto":
            unlit = settings.lighting == "none" and self._work.light_is_slow
            by_itself = " (too slow)" if unlit else " (auto)"
        self.light.setText(f"Light: {SHORT_LIGHTINGS[settings.lighting]}{by_itself}")

    def _button(self, tip: str) -> QToolButton:
        button = QToolButton()
        button.setToolTip(tip)
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        return button

    def _menu_of(self, button: QToolButton) -> QMenu:
        menu = QMenu(button)
        button.setMenu(menu)
        return menu
