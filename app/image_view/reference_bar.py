"""A compact bar above the reference image: light, brightness, quality, and what draws it."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QHBoxLayout, QMenu, QToolButton, QWidget, QWidgetAction

from app.controls import add_action, add_title
from app.engines.engines import ReferenceSettings
from app.image_view.brightness_slider import BrightnessSlider
from app.image_view.light_ball import LightBall
from app.state.brightness import Brightness
from app.state.reference_choices import ReferenceChoices
from app.state.reference_work import ReferenceWork
from app.state.viewer_state import ViewerState
from model.scene.light import LightRange

LIGHTINGS = {
    "auto": "Automatic: direct, or as the model beside",
    "none": "None",
    "direct": "Direct: shaded surfaces",
    "global": "Global: with shadows",
}

LONGEST_LIGHTS = ("Light: none (too slow)", "Light: direct (auto)", "Light: global (auto)")

DISTANCES = {
    None: "Automatic: 0.5 voxels, or as the model beside",
    1.0: "1 voxel: fast",
    0.5: "0.5 voxels",
    0.25: "0.25 voxels: fine",
}

SIZES = {
    "pane": "As the window",
    "generator": "Same size as the model's",
    256: "256 × 256",
    512: "512 × 512",
    1024: "1024 × 1024",
    2048: "2048 × 2048",
}

DRAWINGS = {
    "auto": "Automatic: ray caster while moving; at rest VTK, if a graphics card draws it",
    "vtk": "VTK alone",
    "raycast": "Ray caster alone",
}

SHORT_DRAWINGS = {"auto": "Renderer", "vtk": "VTK", "raycast": "Ray caster"}


class ReferenceBar(QWidget):
    """Shows and changes how the reference image is drawn.

    Parameters
    ----------
    state : ViewerState
    work : ReferenceWork
    brightness : Brightness
    """

    def __init__(
        self,
        state: ViewerState,
        work: ReferenceWork,
        brightness: Brightness,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._work = work
        self._brightness = brightness
        self._actions: dict[str, dict[Any, Any]] = {}
        self.ball = LightBall(state)
        self.light = self._button("Light of the reference image, and brightness of both")
        self.quality = self._button("Sample distance and size of the reference image")
        self.drawing = self._button("What draws the reference image")
        self.quality.setText("Quality")
        self.fill_light(self._menu_of(self.light))
        self.fill_quality(self._menu_of(self.quality))
        self.fill_drawing(self._menu_of(self.drawing))
        # What stands beside them stays where it is when another is chosen.
        _keep_width(self.light, LONGEST_LIGHTS)
        _keep_width(self.drawing, SHORT_DRAWINGS.values())
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(4)
        for widget in (self.light, self.ball, self.quality, self.drawing):
            row.addWidget(widget)
        work.choicesChanged.connect(self._show_choices)
        work.settingsChanged.connect(self._show_settings)
        work.lightRangeChanged.connect(self._offer_ball)
        self._show_choices(work.choices)
        self._show_settings(work.settings)

    def fill_light(self, menu: QMenu) -> None:
        """Add the kinds of light, and the brightness, to a menu."""
        self._add_choices(menu, "lighting", LIGHTINGS)
        menu.addSeparator()
        action = QWidgetAction(menu)
        action.setDefaultWidget(BrightnessSlider(self._brightness))
        menu.addAction(action)

    def fill_quality(self, menu: QMenu) -> None:
        """Add sample distances and sizes to a menu."""
        add_title(menu, "Distance of samples along each ray")
        self._add_choices(menu, "sample_distance", DISTANCES)
        menu.addSeparator()
        add_title(menu, "Size of the image")
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
        self.drawing.setText(SHORT_DRAWINGS[choices.drawing])
        self._show_settings(self._work.settings)

    def _show_settings(self, settings: ReferenceSettings) -> None:
        note = ""
        if self._work.choices.lighting == "auto":
            unlit = settings.lighting == "none" and self._work.light_is_slow
            note = " (too slow)" if unlit else " (auto)"
        self.light.setText(f"Light: {settings.lighting}{note}")

    def _offer_ball(self, limits: LightRange | None) -> None:
        self.ball.set_light(self._work.settings.light, limits)

    def _button(self, tip: str) -> QToolButton:
        button = QToolButton()
        button.setToolTip(tip)
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        return button

    def _menu_of(self, button: QToolButton) -> QMenu:
        menu = QMenu(button)
        button.setMenu(menu)
        return menu


def _keep_width(button: QToolButton, texts: Iterable[str]) -> None:
    """Make a button as wide as the longest text that it may have."""
    widths = []
    for text in texts:
        button.setText(text)
        widths.append(button.sizeHint().width())
    button.setMinimumWidth(max(widths))
