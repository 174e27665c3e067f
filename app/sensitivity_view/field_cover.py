"""The field of a band of values over one engine's image, with its colour bar."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QRect
from PySide6.QtGui import QImage, QPainter

from app.engines.messages import ValueVisibilityRequest
from app.engines.states import EngineState
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import to_qimage
from app.sensitivity_view.color_bar import paint_bar
from app.state.sensitivity_answers import (
    SOURCE_NAMES,
    FieldAnswer,
    ValueVisibilityAnswer,
    WhatIfAnswer,
)
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.rendering.raster import middle_square
from model.scene.inputs import SceneInputs
from model.scene.tf_perturbation import edit_over
from model.scene.value_text import range_text
from model.sensitivity.display import (
    BACKDROP,
    FLOOR,
    LEAST_DIFFERENCE,
    Shown,
    color_bar,
    overlay,
    scale_of,
    shown_field,
)
from model.sensitivity.trust import BEST_TRUST, trust_levels

KEPT_IMAGES = 6
"""Newest images that are kept until their field arrives."""

LEAST_SEEN = 0.02
"""Least part of a pixel at the end of a scale: what is fainter is not seen."""

CONTOUR_SIZE = 512
"""Least size of pictures with contours."""

CONTOURS = (0.15, 0.4, 0.7)
"""Levels of contours, as fractions of the scale."""


class FieldCover(QObject):
    """Shows a field with the very image that it belongs to, or nothing.

    Fields and images arrive at different times. A field covers the pane only together with
    the image of the same inputs; while newer images arrive faster than fields, the last pair
    stays, and is never mixed.

    Parameters
    ----------
    pane : EnginePane
    state : ViewerState
    sensitivity : SensitivityState
    dispatcher : SensitivityDispatcher
    choose : callable
        Returns the answer to show in this pane, or None.
    """

    def __init__(
        self,
        pane: EnginePane,
        state: ViewerState,
        sensitivity: SensitivityState,
        dispatcher: SensitivityDispatcher,
        choose: Callable[[], FieldAnswer | ValueVisibilityAnswer | None],
    ) -> None:
        super().__init__(pane)
        self._pane = pane
        self._state = state
        self._sensitivity = sensitivity
        self._dispatcher = dispatcher
        self._choose = choose
        self._images: OrderedDict[SceneInputs, NDArray[np.float32]] = OrderedDict()
        self._scale = FLOOR
        self._caption = ""
        self._hint = ""
        self._what_if: WhatIfAnswer | None = None
        self._bar: Shown | None = None
        pane.imageShown.connect(self._take_image)
        pane.client.stateChanged.connect(self._check_stop)
        dispatcher.fieldAnswered.connect(self.refresh)
        sensitivity.bandChanged.connect(lambda _band: self.refresh())
        sensitivity.choicesChanged.connect(lambda _choices: self.refresh())
        pane.canvas.add_decoration(self._paint)

    @property
    def caption(self) -> str:
        """Text under the colour bar; empty if no field is shown."""
        return self._caption if self._bar is not None else ""

    @property
    def scale(self) -> float:
        """Value at the end of the colour bar."""
        return self._scale

    def set_hint(self, hint: str) -> None:
        """Mark learned fields while inputs are outside what the model was trained on."""
        self._hint = hint
        self.refresh()

    def image_of(self, inputs: SceneInputs) -> NDArray[np.float32] | None:
        """Return the pane's image (H, W, 3) of some inputs; None if it is not there yet."""
        return self._images.get(inputs)

    def refresh(self) -> None:
        """Show the newest field with its image, or uncover the image."""
        if self._what_if is not None:
            return
        answer = self._choose()
        band = self._sensitivity.band
        shown = self._sensitivity.choices.shown
        if answer is None or band is None or not shown:
            self._uncover()
            return
        if answer.request.values != band.values:
            # The band's own field is on its way; what is there belongs to another value.
            return
        image = self._images.get(answer.request.inputs)
        if image is not None:
            self._cover(answer, image)
        elif not answer.is_of(self._state.inputs):
            self._uncover()

    def show_what_if(self, answer: WhatIfAnswer | None) -> None:
        """Show the difference that an edit makes, or the field again."""
        self._what_if = answer
        if answer is None:
            self._uncover()
            self.refresh()
            return
        what_if = answer.what_if
        difference = np.asarray(what_if.difference.mean(axis=-1), dtype=np.float64)
        self._scale = scale_of(difference, LEAST_DIFFERENCE)
        colored = overlay(what_if.image, difference, self._scale, "signed")
        self._bar = "signed"
        self._caption = f"{self._scale:.2g} (brighter): difference of pixel values by the edit"
        self._pane.canvas.show_cover(_picture(colored))

    def _take_image(self, inputs: SceneInputs, image: NDArray[np.float32]) -> None:
        self._images[inputs] = image[..., :3]
        self._images.move_to_end(inputs)
        while len(self._images) > KEPT_IMAGES:
            self._images.popitem(last=False)
        self.refresh()

    def _check_stop(self, state: EngineState) -> None:
        """Uncover a pane that has lost its image, or whose image is another engine's."""
        if self._pane.canvas.image is None or state is EngineState.LOADING:
            self._images.clear()
            self._what_if = None
            self._uncover()

    def _uncover(self) -> None:
        self._bar = None
        self._pane.canvas.show_cover(None)
        self._pane.canvas.update()

    def _cover(
        self, answer: FieldAnswer | ValueVisibilityAnswer, image: NDArray[np.float32]
    ) -> None:
        choices, request = self._sensitivity.choices, answer.request
        scalar_range = self._state.scalar_range
        seen = isinstance(request, ValueVisibilityRequest)
        shown: Shown = "visible" if seen else choices.measure
        edit = edit_over(request.values, scalar_range, request.width)
        if seen:
            field = answer.value.astype(np.float64)
        else:
            field = shown_field(answer.value, edit, choices.measure)
        keep = choices.locked or self._state.live or self._sensitivity.dragging
        if not keep or self._bar != shown:
            fields = [field]
            if not seen:
                # One scale for exact and learned fields, so that their colours can be compared.
                both = (a for a in self._dispatcher.both_fields if a is not None and a != answer)
                fields += [shown_field(a.value, edit, choices.measure) for a in both]
            least = LEAST_SEEN if seen else FLOOR
            self._scale = max(scale_of(middle_square(each), least) for each in fields)
        # The generator's image and fields are square, the reference's may be wider.
        if _is_square(image):
            field = middle_square(field)
        elif _is_square(field):
            image = middle_square(image)
        trust = self._trust(image) if choices.fade and not seen else None
        if field.shape != image.shape[:2]:
            # Imported here: the window starts without it.
            from skimage.transform import resize

            field = resize(field, image.shape[:2], order=1)
        if choices.style == "contours":
            colored = _with_contours(image, field, self._scale, shown)
        else:
            colored = overlay(image, field, self._scale, shown, trust)
        self._bar = shown
        end, source = " (brighter)" if choices.measure == "signed" else "", answer.source
        self._caption = f"{self._scale:.2g}{end}: slope per +.01 opacity, {SOURCE_NAMES[source]}"
        if seen:
            values = range_text(request.values, scalar_range)
            self._caption = f"{self._scale:.2g}: part of a pixel that shows {values}"
        if answer.source == "learned" and self._hint:
            self._caption += ", outside what it was trained on"
        band = self._sensitivity.band
        if band is not None and band.pinned:
            self._caption += "; Escape returns to the image"
        self._pane.canvas.show_cover(_picture(colored))

    def _trust(self, image: NDArray[np.float32]) -> NDArray[np.int64] | None:
        """Levels of trust over an image; beside the square, where nothing is learned, the best."""
        exact, learned = self._dispatcher.both_fields
        if exact is None or learned is None:
            return None
        levels = np.full(image.shape[:2], BEST_TRUST, dtype=np.int64)
        square = middle_square(levels)
        square[:] = trust_levels(learned.value, middle_square(exact.value), len(square))
        return levels

    def _paint(self, painter: QPainter, rect: QRect) -> None:
        """Paint the colour bar into the lower left corner."""
        if self._bar is None:
            return
        low = f"−{self._scale:.2g} (darker)" if self._bar == "signed" else "0"
        # Where the image is wider than the square, so may the text be.
        right = self._pane.canvas.picture_rect.right()
        paint_bar(painter, rect, right, self._bar, f"{low} to {self._caption}")


def _is_square(image: NDArray[np.floating]) -> bool:
    return image.shape[0] == image.shape[1]


def _picture(colors: NDArray[np.float64]) -> QImage:
    return to_qimage(colors.astype(np.float32))


def _with_contours(
    image: NDArray[np.float32], field: NDArray[np.float64], scale: float, measure: Shown
) -> NDArray[np.float64]:
    """Draw contours of a field into its grey image, enlarged so that lines are thin."""
    # Imported here: the window starts without it.
    from skimage.measure import find_contours
    from skimage.transform import resize

    factor = max(1.0, CONTOUR_SIZE / min(field.shape))
    rows, columns = (round(factor * n) for n in field.shape)
    image = resize(image, (rows, columns, 3), order=1)
    field = resize(field, (rows, columns), order=1)
    gray = BACKDROP * np.clip(image, 0, 1).mean(axis=-1, keepdims=True)
    out = np.repeat(gray.astype(np.float64), 3, axis=-1)
    table = color_bar(measure, 256)
    levels = CONTOURS if measure != "signed" else (*(-level for level in CONTOURS), *CONTOURS)
    for level in levels:
        # Lighter than in a map, as a line is seen less than an area.
        bright = np.sign(level) * (0.4 + 0.6 * abs(level))
        place = bright if measure != "signed" else (bright + 1) / 2
        for line in find_contours(field, level * scale):
            down, right = np.rint(line).astype(int).T
            for lower, further in ((0, 0), (0, 1), (1, 0), (1, 1)):
                at = np.minimum(down + lower, rows - 1), np.minimum(right + further, columns - 1)
                out[at] = table[round(place * 255)]
    return out
