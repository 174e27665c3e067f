"""Overlays of images: cube, legend, scale bar, opacity image, difference; and the background."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
from PySide6.QtCore import QObject, QRect
from PySide6.QtGui import QImage, QPainter

from app.glosses import SENTENCES
from app.image_view.engine_pane import OpacityInset
from app.image_view.image_canvas import ImageCanvas, to_qimage
from app.image_view.orientation_cube import OrientationCube
from app.image_view.picture import BLACK, WHITE, Background
from app.sensitivity_view.field_cover import paint_bar
from app.state.settings import BackgroundChoice
from app.window.context import Context
from app.window.figure import (
    Image,
    Subject,
    difference_of,
    difference_title,
    in_colors,
    paint_legend,
    paint_scale_bar,
)
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF, TransferFunction

BACKGROUNDS: dict[BackgroundChoice, Background] = {
    "black": BLACK,
    "gradient": "gradient",
    "white": WHITE,
}

Overlay = Literal["cube", "legend", "scale_bar", "opacity_images"]  # settings of what may be shown


class Overlays(QObject):
    """Shows what the settings say over each pane's image; nothing while there is no volume."""

    def __init__(self, context: Context) -> None:
        super().__init__(context.window)
        self._panes, self._state = context.panes, context.state
        self._canvases = canvases = [pane.canvas for pane in context.panes]
        self._preferences = context.preferences
        self.subject = Subject()
        self._has_volume = False
        self._previewed: OpacityTF | None = None
        self._cubes = [OrientationCube(context.state, canvas) for canvas in canvases]
        for pane, cube in zip(self._panes, self._cubes, strict=True):
            # While something moves, with each image: it lies over that, and both are painted.
            pane.imageShown.connect(lambda *_, cube=cube: cube.follow())
        self._right = canvases[-1]
        self.insets = [OpacityInset(pane) for pane in self._panes]
        for canvas in canvases:
            canvas.add_decoration(partial(self._paint, canvas))
        self.refresh()

    @property
    def background(self) -> Background:
        """Background of the images."""
        return BACKGROUNDS[self._preferences.settings.background]

    @property
    def legend_tf(self) -> TransferFunction:
        """The TF of the legend: that of the image, or of the picture that covers it."""
        tf = self._state.transfer_function
        return tf if self._previewed is None else replace(tf, opacity=self._previewed)

    def has(self, overlay: Overlay) -> bool:
        """Whether something is shown over the images."""
        return bool(getattr(self._preferences.settings, overlay))

    def toggle(self, overlay: Overlay) -> None:
        """Show something over the images, or hide it."""
        self._preferences.set(**{overlay: not self.has(overlay)})
        self.refresh()

    def choose_background(self, choice: BackgroundChoice) -> None:
        """Put something else behind the images."""
        self._preferences.set(background=choice)
        self.refresh()

    def preview(self, opacity: OpacityTF | None) -> None:
        """Have the legend of a picture of another opacity TF; None for the image's again."""
        self._previewed = opacity
        self._right.update()

    def start_volume(self, subject: Subject) -> None:
        """Show what is wanted of another volume."""
        self.subject = subject
        self._has_volume = True
        self.refresh()

    def lie_over(self, canvas: ImageCanvas) -> None:
        """Show cube and legend over one canvas: the rightmost that is there."""
        self._right = canvas
        self.refresh()

    def refresh(self) -> None:
        """Show what the settings say."""
        for canvas, cube in zip(self._canvases, self._cubes, strict=True):
            cube.setVisible(self.has("cube") and self._has_volume and canvas is self._right)
        for pane, inset in zip(self._panes, self.insets, strict=True):
            inset.set_shown(self.has("opacity_images"))
            pane.set_background(self.background)
            pane.canvas.update()

    def _paint(self, canvas: ImageCanvas, painter: QPainter, _square: QRect) -> None:
        rect, state, subject = canvas.picture_rect, self._state, self.subject
        if self.has("legend") and canvas is self._right:
            paint_legend(painter, rect, self.legend_tf, subject.units, self.background)
        if self.has("scale_bar") and subject.scale is not None:
            bar = subject.scale.bar(state.view, state.crop)
            paint_scale_bar(painter, rect, bar, self.background)


TIP = (
    f"Error (RMSE) against the ground truth, in the square that both images show. "
    f"{SENTENCES['RMSE']} Difference (D) shows where."
)
UNUSUAL = (
    "It is far above the errors of the model's test images: no such TF or view was among them."
)


class ImageError(QObject):
    """Compares both images at rest, and says the error in the generator's caption.

    Where it is wanted, the difference of each pixel is shown over the generator's image.

    Where the generator was trained under another light, or only a part of the volume is shown,
    which models are not trained for, there is nothing to compare.
    """

    def __init__(self, context: Context) -> None:
        super().__init__(context.window)
        self._generator = generator = context.generator
        self._state, self._workspace = context.state, context.workspace
        self._shown: dict[str, tuple[SceneInputs, Image]] = {}
        self._is_wanted = False
        self._difference: QImage | None = None
        self._scale = 0.0
        for name, pane in (("generator", generator), ("reference", context.reference)):
            pane.imageShown.connect(partial(self._take, name))
        generator.canvas.add_decoration(self._paint)
        self._state.inputsChanged.connect(self._clear)

    @property
    def is_wanted(self) -> bool:
        """Whether the difference is shown where there is one."""
        return self._is_wanted

    @property
    def compared(self) -> tuple[Image, Image] | None:
        """The generator's image and the ground truth, (H, W, 3); None where they do not compare."""
        if len(self._shown) < 2:
            return None
        (inputs, drawn), (others, truth) = self._shown["generator"], self._shown["reference"]
        alike = self._workspace.model_lighting == self._workspace.reference.settings.lighting
        is_part = inputs.crop or inputs.mask
        if inputs != others or inputs != self._state.inputs or not alike or is_part:
            return None
        return drawn, truth

    def _take(self, name: str, inputs: SceneInputs, image: Image) -> None:
        self._shown[name] = inputs, image[..., :3]
        if not self._state.live:
            self._compare()

    def _compare(self) -> None:
        if self.compared is None:
            self._clear()
            return
        drawn, truth = self.compared
        difference = difference_of(drawn, truth)
        error = float(np.sqrt(np.mean(difference**2)))
        lighting = self._workspace.reference.settings.lighting
        # Of one sample, the ground truth is the generator's own picture.
        is_same = lighting == "path" and not difference.any()
        said = "" if is_same else f"error {error:.3f}".replace(" 0.", " .")
        is_unusual = self._workspace.model.is_unusual(error)
        tip = f"{TIP} {UNUSUAL}" if is_unusual else TIP
        self._generator.set_note(said, tip, is_unusual)
        self._difference = None
        if self._is_wanted:
            colored, self._scale = in_colors(np.clip(drawn, 0, 1), difference)
            self._difference = to_qimage(colored.astype(np.float32))
        self._generator.canvas.update()

    def set_wanted(self, wanted: bool) -> None:
        """Show the difference over the generator's image, or no longer."""
        self._is_wanted = wanted
        self._compare()

    def _paint(self, painter: QPainter, rect: QRect) -> None:
        canvas = self._generator.canvas
        if self._difference is not None and canvas.cover is None:
            painter.drawImage(rect, self._difference)
            text = f"0 to {self._scale:.2g}: {difference_title(self._difference.width())}"
            paint_bar(painter, rect, canvas.picture_rect.right(), "change", text)

    def _clear(self) -> None:
        if self._difference is None and not self._generator.note:
            return
        self._difference = None
        self._generator.set_note("")
        self._generator.canvas.update()

    def forget(self) -> None:
        """Compare nothing until the generator has drawn anew."""
        self._shown.pop("generator", None)
        self._clear()
