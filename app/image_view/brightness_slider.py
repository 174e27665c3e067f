"""A slider for the brightness of the images, for menus."""

from __future__ import annotations

import math

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSlider, QToolButton, QWidget

from app.controls import text_button
from app.state.brightness import BRIGHTEST, DARKEST, STEPS_PER_OCTAVE, Brightness
from app.wheel_guard import WheelGuard
from model.rendering.brightness import LIT_BRIGHTNESS


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
