"""Controls of how the reference image is drawn: light and brightness, size, renderer."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from PySide6.QtCore import QObject, QSignalBlocker, Qt
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QSlider,
    QToolButton,
    QWidget,
    QWidgetAction,
)

from app.caption_button import CaptionButton
from app.controls import add_action, text_button
from app.engines.engines import ReferenceSettings
from app.image_view.light_ball import LightBall
from app.state.brightness import BRIGHTEST, DARKEST, STEPS_PER_OCTAVE, Brightness
from app.state.reference_choices import ReferenceChoices
from app.state.reference_work import ReferenceWork
from app.state.viewer_state import ViewerState
from app.wheel_guard import WheelGuard
from model.rendering.brightness import LIT_BRIGHTNESS
from model.rendering.path_tracing import denoising
from model.scene.light import LightRange
from model.scene.scene import RENDERER_NAMES

LIGHTINGS = {
    "auto": "Automatic: the model's light, else soft where that is fast",
    "none": "None",
    "direct": "Direct: shaded surfaces",
    "soft": "Soft: shadows and ambient light",
    "path": "Path traced: light scattered many times",
}

LIGHT_NAMES = {
    "none": "None",
    "direct": "Direct",
    "soft": "Soft",
    "path": "Path traced",
}
"""Light that there is, on the button."""

SIZES = {
    "pane": "As large as the pane",
    "generator": "As large as the model's image",
    256: "256 × 256",
    512: "512 × 512",
    1024: "1024 × 1024",
    2048: "2048 × 2048",
}

DRAWINGS: dict[Any, str] = {
    "auto": "Automatic: the faster one while moving; VTK at rest, with a GPU",
    **{name: f"{text[:1].upper()}{text[1:]} only" for name, text in RENDERER_NAMES.items()},
}


class BrightnessSlider(QWidget):
    """Shows and changes the brightness, with a button that sets it back to the usual one."""

    def __init__(self, brightness: Brightness, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._brightness = brightness
        label = QLabel("Brightness")
        self.slider = QSlider(Qt.Orientation.Horizontal)
        WheelGuard(self.slider)
        self.slider.setRange(
            round(STEPS_PER_OCTAVE * math.log2(DARKEST)),
            round(STEPS_PER_OCTAVE * math.log2(BRIGHTEST)),
        )
        self.slider.setMinimumWidth(150)
        self.slider.setToolTip(
            "Brighten or darken both images. Dark colours change by this factor, bright ones by "
            f"less, so that none saturates. Lit images start at {LIT_BRIGHTNESS:g}×. Saved "
            "pictures have the same brightness."
        )
        self.number = QLabel()
        # Wide enough for any number, so that the slider keeps its place.
        self.number.setMinimumWidth(self.fontMetrics().horizontalAdvance("0.00×"))
        self.reset: QToolButton = text_button("Reset", "The usual brightness of this light")
        row = QHBoxLayout(self)
        row.setContentsMargins(20, 4, 12, 4)
        for widget in (label, self.slider, self.number, self.reset):
            row.addWidget(widget)
        self.slider.valueChanged.connect(self._set_step)
        self.slider.sliderReleased.connect(brightness.finish)
        self.reset.clicked.connect(lambda: brightness.set(None))
        brightness.changed.connect(self._show)
        self._show()

    def _set_step(self, step: int) -> None:
        if self.slider.isSliderDown():
            self._brightness.move(step)
        else:
            self._brightness.set_step(step)

    def _show(self) -> None:
        with QSignalBlocker(self.slider):
            self.slider.setValue(self._brightness.step)
        self.number.setText(f"{self._brightness.value:.2f}×")
        self.reset.setEnabled(self._brightness.is_chosen)


class ReferenceControls(QObject):
    """Shows and changes how the reference image is drawn.

    The button says which light there is; its menu has the others.
    """

    def __init__(
        self,
        state: ViewerState,
        work: ReferenceWork,
        brightness: Brightness,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._work = work
        self.ball = LightBall(state)
        self.light = CaptionButton()
        menu = self.light.add_menu()
        group = QActionGroup(menu)
        self._lights: dict[str, QAction] = {}
        for choice, text in LIGHTINGS.items():
            action = add_action(menu, text, partial(work.choose, lighting=choice))
            action.setCheckable(True)
            group.addAction(action)
            self._lights[choice] = action
        menu.addSeparator()
        self._denoises = menu.addAction("Denoise path-traced light")
        self._denoises.setCheckable(True)
        self._denoises.setToolTip(
            "Removes noise from images of few samples. Without it, light is soft while something "
            "moves."
        )
        self._denoises.setEnabled(denoising.installed())
        self._denoises.triggered.connect(lambda checked: work.choose(denoises=checked))
        menu.addSeparator()
        slider = QWidgetAction(menu)
        slider.setDefaultWidget(BrightnessSlider(brightness))
        menu.addAction(slider)
        work.choicesChanged.connect(self._show_choices)
        work.settingsChanged.connect(self._show_settings)
        work.lightRangeChanged.connect(self._offer_ball)
        self._show_choices(work.choices)
        self._show_settings(work.settings)

    def _show_choices(self, choices: ReferenceChoices) -> None:
        self._lights[choices.lighting].setChecked(True)
        self._denoises.setChecked(choices.denoises)
        self._show_settings(self._work.settings)

    def _show_settings(self, settings: ReferenceSettings) -> None:
        is_automatic = self._work.choices.lighting == "auto"
        unlit = is_automatic and settings.lighting == "none" and self._work.light_is_slow
        self.light.set_title(LIGHT_NAMES[settings.lighting] + (" (too slow)" if unlit else ""))
        self.light.setAccessibleName(f"Light: {self.light.title}")
        chosen = "Light, chosen automatically" if is_automatic else "Light"
        self.light.setToolTip(f"{chosen}\nLight of the ground truth, and brightness of both images")

    def _offer_ball(self, limits: LightRange | None) -> None:
        self.ball.set_light(self._work.settings.light, limits)
