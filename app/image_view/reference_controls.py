"""Controls of how the reference image is drawn: light and brightness, with a ball for the light."""

import math
from typing import Any

from PySide6.QtCore import QObject, QPointF, QSignalBlocker, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QRadialGradient
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSlider, QWidget, QWidgetAction

from app import theme
from app.caption_button import CaptionButton
from app.controls import CLICK_REACH, WheelGuard, add_choices, add_switch, fill, text_button
from app.image_view.gestures import light_at
from app.state.edits import BRIGHTEST, DARKEST, STEPS_PER_OCTAVE, Brightness, brightness_at
from app.state.reference_image import ReferenceImage
from app.state.viewer_state import ViewerState
from model.rendering.brightness import LIT_BRIGHTNESS
from model.rendering.path_tracing import denoising
from model.scene.ranges import without_zero
from model.scene.scene import RENDERER_NAMES, LightDirection, LightRange

LIGHTINGS = {
    "auto": "Automatic: soft if fast enough; with a model, the model's light",
    "none": "None",
    "direct": "Direct: shaded surfaces",
    "soft": "Soft: shadows and ambient light",
    "path": "Path traced: light scattered many times",
}

SIZES = {
    None: "As large as the pane",
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
    """Shows and changes the brightness, with a button that resets it."""

    def __init__(self, brightness: Brightness) -> None:
        super().__init__()
        self._brightness = brightness
        label = QLabel("Brightness")
        self.slider = QSlider(Qt.Orientation.Horizontal)
        WheelGuard(self.slider)
        ends = (round(STEPS_PER_OCTAVE * math.log2(end)) for end in (DARKEST, BRIGHTEST))
        self.slider.setRange(*ends)
        self.slider.setMinimumWidth(150)
        self.slider.setToolTip(
            "Brighten or darken both images. Dark colours change by this factor, bright ones by "
            f"less, so that none saturates. Lit images start at {LIT_BRIGHTNESS:g}×, and "
            "a TF of a brightened picture (Browse TFs) with that. Saved pictures are as bright."
        )
        self.number = QLabel()
        # Wide enough for any number, so that the slider keeps its place.
        self.number.setMinimumWidth(self.fontMetrics().horizontalAdvance("0.00×"))
        tip = "Take back the usual brightness of this light"
        self.reset = text_button("Reset", tip, lambda: brightness.set(None))
        row = QHBoxLayout(self)
        fill(row, label, self.slider, self.number, self.reset, margins=(20, 4, 12, 4), spacing=6)
        self.slider.valueChanged.connect(self._set_step)
        self.slider.sliderReleased.connect(brightness.finish)
        brightness.changed.connect(self._show)
        self._show()

    def _set_step(self, step: int) -> None:
        is_drag = self.slider.isSliderDown()
        (self._brightness.move if is_drag else self._brightness.set)(brightness_at(step))

    def _show(self) -> None:
        with QSignalBlocker(self.slider):
            self.slider.setValue(self._brightness.step)
        factor = f"{self._brightness.of('exact'):.2f}"
        self.number.setText(f"{without_zero(factor)}×")
        self.reset.setEnabled(self._brightness.value is not None)


class ReferenceControls(QObject):
    """Shows and changes how the reference image is drawn."""

    def __init__(self, state: ViewerState, work: ReferenceImage, parent: QObject) -> None:
        super().__init__(parent)
        self._work = work
        self.ball = LightBall(state)
        self.light = CaptionButton()
        self.light.titles = ("Path traced",)  # the longest: the menu keeps its place
        menu = self.light.add_menu()
        lights = {choice: (text, "") for choice, text in LIGHTINGS.items()}
        self._lights = add_choices(
            menu, lights, lambda lighting: work.choose_look(lighting=lighting)
        )
        menu.addSeparator()
        self._denoises = add_switch(
            menu,
            "Denoise path-traced light",
            "Removes noise from images of few samples. Without it, moving images have soft light.",
            lambda checked: work.choose(denoises=checked),
        )
        self._denoises.setEnabled(denoising.installed())
        menu.addSeparator()
        slider = QWidgetAction(menu)
        slider.setDefaultWidget(BrightnessSlider(state.brightness))
        menu.addAction(slider)
        self._tf_input = state.tf_input
        work.settingsChanged.connect(lambda _settings: self._show())
        work.lightRangeChanged.connect(
            lambda limits: self.ball.set_light(work.edited.light, limits)
        )
        self._show()

    def _show(self) -> None:
        """Show the light of the pane with the focus."""
        pane, settings = self._tf_input.pane, self._work.edited
        choices = self._work.choices_of(pane)
        self._lights[choices.lighting].setChecked(True)
        self._denoises.setChecked(choices.denoises)
        is_automatic = choices.lighting == "auto"
        unlit = is_automatic and settings.lighting == "none" and "direct" in self._work.slow_lights
        name = LIGHTINGS[settings.lighting].partition(":")[0] + (" (too slow)" if unlit else "")
        of = f"{pane}: " if self._tf_input.compares else ""
        self.light.title = f"{of}{name}"
        self.light.setAccessibleName(f"Light: {self.light.title}")
        why = ": soft light takes too long here" if "soft" in self._work.slow_lights else ""
        chosen = f"Light, chosen automatically{why}" if is_automatic else "Light"
        whose = f"image {pane}" if of else "the ground truth"
        self.light.setToolTip(f"{chosen}\nLight of {whose}, and brightness of both images")


DIAMETER = 20

REACH = 60.0  # pixels that a drag moves the light by the ball's radius

MOVABLE = (
    "Drag to move the light, click to aim it, double-click for light from the upper left. In an "
    "image: Ctrl+Shift and drag."
)
FIXED = (
    "The light is fixed, as the open model was trained with it. Close the model to move the light."
)


class LightBall(QWidget):
    """Shows the light's direction, which a drag or a click changes where the light is movable."""

    def __init__(self, state: ViewerState) -> None:
        super().__init__()
        self._state = state
        self._fixed = LightDirection()
        self._limits = LightRange()
        self._pressed = QPointF()
        self._start: tuple[float, float] | None = None
        self._moved = False
        self.setFixedSize(QSize(DIAMETER, DIAMETER))
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setAccessibleName("Light direction")
        # Its neighbours keep their places.
        policy = self.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.setSizePolicy(policy)
        self._painted = LightDirection()
        state.inputsChanged.connect(self._follow)
        self.set_light(None, None)

    def set_light(self, light: LightDirection | None, limits: LightRange | None) -> None:
        """Offer a light within a range; None hides the ball, and without limits it is fixed."""
        self._fixed = light or LightDirection()
        self._limits = limits or LightRange()
        self.setVisible(light is not None)
        self.setEnabled(limits is not None)
        self.setToolTip(MOVABLE if limits is not None else FIXED)
        self.update()

    @property
    def direction(self) -> LightDirection:
        """Direction of the light that is shown."""
        return self._state.light or self._fixed

    def _follow(self) -> None:
        # Not at every step of another drag: the window would be painted once more.
        if self.direction != self._painted:
            self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a drag, or a click."""
        right, up, _ = self.direction.towards()
        self._pressed, self._start, self._moved = event.position(), (right, up), False

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the light with the mouse."""
        moved = event.position() - self._pressed
        if self._start is None or (not self._moved and moved.manhattanLength() <= CLICK_REACH):
            return
        self._moved = True
        x, y = self._start
        self._aim(x + moved.x() / REACH, y - moved.y() / REACH)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the movement and request the final images; a click moves the light there."""
        if self._start is not None and not self._moved:
            radius, at = DIAMETER / 2, event.position()
            self._aim(at.x() / radius - 1, 1 - at.y() / radius)
        self._start = None
        self._state.light_input.finish()

    def _aim(self, x: float, y: float) -> None:
        self._state.light_input.move(light_at(x, y, self._limits))

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Return to the default direction."""
        self._start = None
        self._state.light_input.set(self._limits.nearest(LightDirection()))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint a ball with a highlight in the light's direction."""
        self._painted = self.direction
        right, up, _ = self._painted.towards()
        middle, radius = QPointF(DIAMETER / 2, DIAMETER / 2), DIAMETER / 2 - 1
        spot = middle + QPointF(right, -up) * (0.85 * radius)
        shade = QRadialGradient(middle, radius, spot)
        # A lit ball looks alike in both themes.
        lit = theme.ON_IMAGE.text if self.isEnabled() else theme.ON_IMAGE.disabled
        shade.setColorAt(0.0, QColor(lit))
        shade.setColorAt(1.0, QColor(theme.CANVAS))
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(theme.DIM if self.isEnabled() else theme.DISABLED))
        painter.setBrush(shade)
        painter.drawEllipse(middle, radius, radius)
