"""The field of a band of values over one engine's image, with its colour bar."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QImage

from app.engines.requests import BlockFieldsRequest, Request, ValueVisibilityRequest
from app.engines.states import EngineState
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import to_qimage
from app.sensitivity_view.color_bar import ColorBar
from app.short_numbers import short
from app.state.sensitivity_answers import SOURCE_NAMES, Answer, WhatIfAnswer
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.rendering.raster import middle_square
from model.scene.inputs import SceneInputs
from model.scene.tf_perturbation import edit_over
from model.scene.value_text import range_text
from model.sensitivity.block_fields import field_bins, field_of_band, over_pixels, pixels_of_block
from model.sensitivity.display import (
    BACKDROP,
    FLOOR,
    LEAST_DIFFERENCE,
    Shown,
    color_bar,
    overlay,
    scale_of,
    shown_field,
    shown_responses,
)
from model.sensitivity.global_scale import global_scale, overlay_globally
from model.sensitivity.measure import Measure
from model.sensitivity.trust import BEST_TRUST, trust_levels

KEPT_IMAGES = 6
"""Newest images that are kept until their field arrives."""

MEASURES: tuple[Measure, ...] = ("change", "signed")
"""Order of the ends of scales in a range of fields."""

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

    changed = Signal()
    """Emitted when a field is shown, or none any more."""

    def __init__(
        self,
        pane: EnginePane,
        state: ViewerState,
        sensitivity: SensitivityState,
        dispatcher: SensitivityDispatcher,
        choose: Callable[[], Answer[Any] | None],
    ) -> None:
        super().__init__(pane)
        self._pane = pane
        self._state = state
        self._sensitivity = sensitivity
        self._dispatcher = dispatcher
        self._choose = choose
        self._images: OrderedDict[SceneInputs, NDArray[np.float32]] = OrderedDict()
        self._scale = self._own = FLOOR
        self._is_of_all = False
        self._largest: tuple[Answer[Any] | None, float] = (None, 0.0)
        self._caption = ""
        self._hint = ""
        self._what_if: WhatIfAnswer | None = None
        self._shown_as: Shown | None = None
        self.bar = ColorBar(pane.canvas, sensitivity)
        pane.imageShown.connect(self._take_image)
        pane.client.stateChanged.connect(self._check_stop)
        dispatcher.answers.fieldAnswered.connect(self.refresh)
        sensitivity.bandChanged.connect(lambda _band: self.refresh())
        sensitivity.choicesChanged.connect(lambda _choices: self.refresh())

    @property
    def caption(self) -> str:
        """What the colours mean, as a sentence; empty if no field is shown."""
        return self._caption if self._shown_as is not None else ""

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
        if not self._is_wanted(answer.request):
            # The band's own field is on its way; what is there belongs to another value.
            return
        image = self._images.get(answer.request.inputs)
        if image is not None:
            self._cover(answer, image)
        elif not answer.is_of(self._state.inputs):
            self._uncover()

    def _is_wanted(self, request: Request) -> bool:
        """Whether an answer is about the present band, or about all values in the chosen blocks."""
        band, choices = self._sensitivity.band, self._sensitivity.choices
        if isinstance(request, BlockFieldsRequest):
            return (request.blocks, request.width) == (choices.blocks, choices.width)
        return band is not None and request.values == band.values  # type: ignore[attr-defined]

    def show_what_if(self, answer: WhatIfAnswer | None, edit: str = "") -> None:
        """Show the difference that an edit makes, and say which edit; or the field again."""
        was_shown, self._what_if = self._what_if is not None, answer
        if answer is None:
            if was_shown:
                self._pane.name_cover("")
            self._uncover()
            self.refresh()
            return
        what_if = answer.what_if
        difference = np.asarray(what_if.difference.mean(axis=-1), dtype=np.float64)
        self._scale, self._is_of_all = scale_of(difference, LEAST_DIFFERENCE), False
        colored = overlay(what_if.image, difference, self._scale, "signed")
        self._caption = f"{self._scale:.2g} (brighter): difference of pixel values by {edit}"
        self._show(colored, "signed", "by the edit")
        detail = f"{edit}: changes {short(what_if.rmse)}, {SOURCE_NAMES[answer.source]}"
        self._pane.name_cover("What if", detail, self._caption)

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
            self.show_what_if(None)

    def _uncover(self) -> None:
        was_shown, self._shown_as = self._shown_as, None
        self.bar.hide()
        # What another has laid there, such as a picture of the map, is not this one's to take.
        if was_shown is not None:
            self._pane.canvas.show_cover(None)
            self._pane.name_cover("")
            self.changed.emit()
        self._pane.canvas.update()

    def _show(self, colored: NDArray[np.float64], measure: Shown, meaning: str) -> None:
        """Cover the image by a picture, whose colours are said in the bar."""
        self._shown_as = measure
        self._pane.canvas.show_cover(_picture(colored))
        high = f"{100 * self._scale:.2g} %" if measure == "visible" else short(self._scale)
        is_signed = measure == "signed" and not self._is_of_all
        texts = (short(-self._scale), short(self._scale, signed=True), meaning)
        self.bar.show_scale(
            measure,
            texts if is_signed else ("0", high, meaning),
            self._caption,
            is_global=self._is_of_all,
        )
        self.changed.emit()

    def _cover(self, answer: Answer[Any], image: NDArray[np.float32]) -> None:
        if isinstance(answer.request, ValueVisibilityRequest):
            self._cover_visible(answer, image)
            return
        choices = self._sensitivity.choices
        field = self._shown(answer)
        # One scale for exact and learned fields, so that their colours can be compared.
        others = [a for a in self._dispatcher.answers.both_shown_fields if a not in (None, answer)]
        every = [answer, *(other for other in others if other is not None)]
        if not self._keeps_scale or self._shown_as != choices.measure:
            self._own = max(scale_of(middle_square(self._shown(each))) for each in every)
            ends = [end for each in every if (end := self._end_of_all(each)) is not None]
            # Lines are drawn at fractions of the field's own end.
            in_colors = choices.scale == "all" and choices.style != "contours"
            self._is_of_all = in_colors and bool(ends)
            self._scale = max(ends) if self._is_of_all else self._own
        field, image = _square_together(field, image)
        in_blocks = isinstance(answer.request, BlockFieldsRequest)
        trust = self._trust(image) if choices.fade and not in_blocks else None
        if in_blocks:
            field = self._over_pixels(answer, field, len(image))
        else:
            field = _resized(field, image)
        if choices.style == "contours":
            colored = _with_contours(image, field, self._own, choices.measure)
        elif self._is_of_all:
            colored = overlay_globally(image, field, self._own, self._scale)
        else:
            colored = overlay(image, field, self._scale, choices.measure, trust)
        self._caption = self._described(answer)
        self._show(colored, choices.measure, f"per .01, {SOURCE_NAMES[answer.source]}")
        band = self._sensitivity.band
        if band is not None:
            values = range_text(band.values, self._state.scalar_range, self._state.scale)
            self._name(f"What an edit at {values} changes", answer)

    def _cover_visible(self, answer: Answer[Any], image: NDArray[np.float32]) -> None:
        """Show where values are visible."""
        field = np.asarray(answer.value, dtype=np.float64)
        if not self._keeps_scale or self._shown_as != "visible":
            self._own = self._scale = scale_of(middle_square(field), LEAST_SEEN)
            self._is_of_all = False
        field, image = _square_together(field, image)
        field = _resized(field, image)
        if self._sensitivity.choices.style == "contours":
            colored = _with_contours(image, field, self._scale, "visible")
        else:
            colored = overlay(image, field, self._scale, "visible")
        values = range_text(answer.request.values, self._state.scalar_range, self._state.scale)
        self._caption = f"{self._scale:.2g}: part of a pixel that shows {values}{self._way_back}"
        self._show(colored, "visible", "of the pixel")
        self._name(f"Where {values} is visible", answer)

    def _name(self, title: str, answer: Answer[Any]) -> None:
        """Have the image's caption say what covers it, and who found it."""
        self._pane.name_cover(title, SOURCE_NAMES[answer.source], self._caption)

    @property
    def _keeps_scale(self) -> bool:
        """Whether the scale stays as it is while something moves."""
        is_moving = self._state.live or self._sensitivity.dragging
        return is_moving or self._sensitivity.choices.locked

    @property
    def _way_back(self) -> str:
        band = self._sensitivity.band
        is_pinned = band is not None and band.pinned
        return "; Escape returns to the image" if is_pinned else ""

    def _shown(self, answer: Answer[Any]) -> NDArray[np.float64]:
        """Field of the present band in the displayed unit: of pixels, or of blocks."""
        request, scalar_range = answer.request, self._state.scalar_range
        measure = self._sensitivity.choices.measure
        if not isinstance(request, BlockFieldsRequest):
            edit = edit_over(request.values, scalar_range, request.width)
            return shown_field(answer.value, edit, measure)
        band = self._sensitivity.band
        assert band is not None
        chosen = field_of_band(answer.value, band.values, scalar_range)
        pixels = pixels_of_block(request.quality.size, len(chosen))
        field = shown_responses(chosen, pixels, request.width)
        return field if measure == "signed" else np.asarray(np.abs(field))

    def _end_of_all(self, answer: Answer[Any]) -> float | None:
        """End of the scale of the fields of all values; None as long as it is not known."""
        measure = self._sensitivity.choices.measure
        if isinstance(answer.request, BlockFieldsRequest):
            if self._largest[0] is not answer:
                request = answer.request
                inside = field_bins(self._dispatcher.window, self._state.scalar_range)
                pixels = pixels_of_block(request.quality.size, len(answer.value))
                end = global_scale(answer.value[..., inside], pixels, request.width)
                self._largest = answer, end
            return self._largest[1]
        found = self._dispatcher.answers.ranges.get(answer.source)
        if found is None or not found.is_of(answer.request.inputs):
            return None
        if found.request.width != answer.request.width:
            # Of edits as wide as before; the others are on their way.
            return None
        return float(found.value[MEASURES.index(measure)])

    def _over_pixels(
        self, answer: Answer[Any], field: NDArray[np.float64], size: int
    ) -> NDArray[np.float64]:
        """Spread a field of blocks over the pixels of the image."""
        spread = np.asarray(over_pixels(field, size), dtype=np.float64)
        view = answer.request.inputs.view
        if answer.source == "learned" and (view.pan_x, view.pan_y) != (0.0, 0.0):
            # Imported here: the window starts without it.
            from model.generator.panning import panned

            # The generator's blocks are those of its image, which is panned afterwards.
            return panned(spread[..., None].astype(np.float32), view)[..., 0].astype(np.float64)
        return spread

    def _described(self, answer: Answer[Any]) -> str:
        """Text about a field under its colour bar."""
        choices, request = self._sensitivity.choices, answer.request
        is_signed = choices.measure == "signed" and not self._is_of_all
        end = " (brighter)" if is_signed else ""
        over = ", over all values" if self._is_of_all else ""
        text = f"{self._scale:.2g}{end}{over}: slope per +.01 opacity, "
        text += SOURCE_NAMES[answer.source]
        if isinstance(request, BlockFieldsRequest):
            blocks = f"{request.blocks} × {request.blocks} blocks" if request.blocks else "pixels"
            text += f", {blocks}"
        if answer.source == "learned" and self._hint:
            text += ", outside what it was trained on"
        return text + self._way_back

    def _trust(self, image: NDArray[np.float32]) -> NDArray[np.int64] | None:
        """Levels of trust over an image; beside the square, where nothing is learned, the best."""
        exact, learned = self._dispatcher.answers.both_fields
        if exact is None or learned is None:
            return None
        levels = np.full(image.shape[:2], BEST_TRUST, dtype=np.int64)
        square = middle_square(levels)
        square[:] = trust_levels(learned.value, middle_square(exact.value), len(square))
        return levels


def _is_square(image: NDArray[np.floating]) -> bool:
    return image.shape[0] == image.shape[1]


def _square_together(
    field: NDArray[np.float64], image: NDArray[np.float32]
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Cut to the middle square what is wider than the other: the generator's is square."""
    if _is_square(image):
        return middle_square(field), image
    return field, middle_square(image) if _is_square(field) else image


def _resized(field: NDArray[np.float64], image: NDArray[np.float32]) -> NDArray[np.float64]:
    """Resample a field to the size of an image."""
    if field.shape == image.shape[:2]:
        return field
    # Imported here: the window starts without it.
    from skimage.transform import resize

    return np.asarray(resize(field, image.shape[:2], order=1))


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
