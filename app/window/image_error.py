"""The error of the generator's image: how far, and where, it is from the ground truth."""

from __future__ import annotations

from functools import partial

import numpy as np
from PySide6.QtCore import QObject, QRect
from PySide6.QtGui import QImage, QPainter

from app.glosses import SENTENCES
from app.image_view.image_canvas import to_qimage
from app.sensitivity_view.field_cover import paint_bar
from app.window.context import Context
from app.window.figure import Image, difference_of, difference_title, in_colors
from model.scene.inputs import SceneInputs

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

    Where the generator was trained under another light, or the volume is cropped, which models
    are not trained for, there is nothing to compare.
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
        self._workspace.modelChanged.connect(self._forget)

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
        if inputs != others or inputs != self._state.inputs or not alike or inputs.crop:
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

    def _forget(self) -> None:
        self._shown.pop("generator", None)
        self._clear()
