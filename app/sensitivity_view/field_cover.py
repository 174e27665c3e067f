"""The field of a band of values over one engine's image, and the colour bars of such fields."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QToolButton

from app import theme
from app.engines.client import EngineState
from app.engines.requests import Array, ValueVisibilityRequest
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import ImageCanvas, paint_plate, picture_on
from app.number_box import short
from app.sensitivity_view.what_if import RenderedEdit, effect_text
from app.state.sensitivity_asker import Answer, SensitivityAsker
from app.state.sensitivity_state import SensitivityState
from model.rendering.raster import middle_square
from model.scene.inputs import SceneInputs
from model.scene.tf_perturbation import band_of_edit, edit_over
from model.sensitivity import display

Field = NDArray[np.float64]

BAR, HEIGHT, MARGIN = QSize(140, 10), 24, 8
BACKING = 190  # opacity of the background behind the text, of 255
ROOM = 60  # height of the lines above a painted bar, at most, in pixels
LOCKED = "locked"
TIP = "Click to keep the scale of colours and curve, to compare"


class ColorBar(QToolButton):
    """Colour bar over an image; a click locks or unlocks its scale."""

    def __init__(self, canvas: ImageCanvas, sensitivity: SensitivityState) -> None:
        super().__init__(canvas)
        self._canvas, self._sensitivity = canvas, sensitivity
        self._bar = QImage()
        self._texts = ("", "", "")
        font = self.font()
        font.setPixelSize(theme.SMALL_PIXELS)
        self.setFont(font)
        self.setFixedHeight(HEIGHT)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.clicked.connect(lambda: sensitivity.choose(locked=not sensitivity.choices.locked))
        canvas.resized.connect(self.place)
        self.hide()

    def show_scale(self, bar: QImage, texts: tuple[str, str, str], tip: str) -> None:
        """Show a scale."""
        self._bar = bar
        self._texts = texts
        self.setToolTip(f"{tip}\n{TIP}")
        self.setAccessibleName(f"Colours: {texts[0]} to {texts[1]} {texts[2]}")
        self.place()
        self.show()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint lower end, bar, upper end and meaning."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colors = theme.ON_IMAGE
        painter.setPen(QColor(colors.change if self.hasFocus() else colors.line))
        painter.setBrush(QColor(colors.panel))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 4, 4)
        x = float(MARGIN)
        low, high, meaning = self._texts
        for text, color in (
            (low, colors.dim), (None, ""), (high, colors.text), (meaning, colors.dim),
            (self._lock, colors.change),
        ):  # fmt: skip
            if text is None:
                box = QRectF(x, (HEIGHT - BAR.height()) / 2, self._bar_width, BAR.height())
                painter.drawImage(box, self._bar)
                x += self._bar_width + MARGIN
                continue
            painter.setPen(QColor(color))
            wide = self._width_of(text)
            flags = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft
            painter.drawText(QRectF(x, 0, wide + 2, HEIGHT), flags, text)
            x += wide + MARGIN

    @property
    def _bar_width(self) -> float:
        return min(BAR.width(), max(self._canvas.width() / 4, 30))

    def _width_of(self, text: str) -> float:
        return QFontMetricsF(self.font()).horizontalAdvance(text)

    def place(self) -> None:
        """Lie in the middle of the lower edge, as wide as the text."""
        texts = (*self._texts, self._lock)
        width = round(sum(self._width_of(text) + MARGIN for text in texts) + self._bar_width)
        self.setFixedWidth(min(width + 2 * MARGIN, max(self._canvas.width() - 2 * MARGIN, 40)))
        # It must not cover the corners with scale bar and legend.
        at = self._canvas.width() // 2 - self.width() // 2
        self.move(at, self._canvas.height() - HEIGHT - MARGIN)
        self.update()

    @property
    def _lock(self) -> str:
        return LOCKED if self._sensitivity.choices.locked else ""


def paint_bar(painter: QPainter, rect: QRect, bar: QImage, text: str) -> None:
    """Paint a colour bar into an image's lower right corner, with a text above it."""
    x, y = rect.right() - MARGIN - BAR.width(), rect.bottom() - MARGIN - BAR.height()
    painter.drawImage(QRectF(x, y, BAR.width(), BAR.height()), bar)
    painter.setPen(QPen(QColor(theme.ON_IMAGE.dim), 1))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(QRectF(x, y, BAR.width(), BAR.height()))
    flags = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap
    room = QRectF(rect.left() + MARGIN, y - 4 - ROOM, rect.width() - 2 * MARGIN, ROOM)
    # Images may be bright there. Without a pen, Qt knows no size of a text.
    plate = painter.boundingRect(room, flags, text).adjusted(-4, -2, 4, 2)
    paint_plate(painter, plate, theme.ON_IMAGE.field, BACKING)
    painter.setPen(QColor(theme.ON_IMAGE.text))
    painter.drawText(room, flags, text)


RISES = "if opacity rises by .01"  # the edit whose change is shown
KEPT_S = 1.0  # time for which images wait for their field; the newest one waits without limit
LEAST_SEEN = 0.02  # least share of a pixel at the end of a scale: fainter values are invisible


class FieldCover(QObject):
    """Shows a field together with the image that it belongs to, or nothing.

    Fields and images arrive at different times. A field covers the pane only with the image of the
    same inputs. While images arrive faster than fields, the last pair stays.
    """

    def __init__(
        self,
        pane: EnginePane,
        asker: SensitivityAsker,
        choose: Callable[[], Answer[Any] | None],
        changed: Callable[[], object],
    ) -> None:
        super().__init__(pane)
        self.pane, self._asker = pane, asker
        self._state, self._asked = asker.state, asker.asked
        self._choose, self._changed = choose, changed
        self._images: list[tuple[float, SceneInputs, Array]] = []
        self.scale = display.FLOOR  # value at the end of the colour bar
        self._caption = ""
        self._what_if: RenderedEdit | None = None
        self._shown_as: display.Shown | None = None
        self.bar = ColorBar(pane.canvas, asker.asked)
        pane.imageShown.connect(self._take_image)
        pane.client.stateChanged.connect(self.check_stop)

    @property
    def caption(self) -> str:
        """Meaning of the colours, in a sentence; empty if no field is shown."""
        return self._caption if self._shown_as is not None else ""

    def image_of(self, inputs: SceneInputs) -> Array | None:
        """Return the pane's image (H, W, 3) of some inputs; None if it is not there yet."""
        found = (image for _, of, image in reversed(self._images) if of == inputs)
        return next(found, None)

    def refresh(self) -> None:
        """Show the newest field with its image, or uncover the image."""
        if self._what_if is not None:
            return
        answer = self._choose()
        band = self._asked.band
        shown = self._asked.choices.shown
        if answer is None or band is None or not shown:
            self._uncover()
            return
        if answer.request.values != band.values:
            # The band's own field is on its way; what is there belongs to another value.
            return
        image = self.image_of(answer.request.inputs)
        if image is not None and are_alike(np.shape(answer.value), image.shape):
            self._cover(answer, image)
        elif image is not None or not answer.is_of(self._state.inputs):
            # Of other proportions, one of them is of the pane's size before.
            self._uncover()

    def show_what_if(self, answer: RenderedEdit | None, edit: str = "") -> None:
        """Show the difference that an edit makes, and name the edit; or show the field again."""
        was_shown, self._what_if = self._what_if is not None, answer
        if answer is None:
            if was_shown:
                self.pane.name_cover("")
            self._uncover()
            self.refresh()
            return
        what_if = answer.what_if
        difference = np.asarray(what_if.difference.mean(axis=-1), dtype=np.float64)
        self.scale = display.scale_of(difference, display.LEAST_DIFFERENCE)
        meaning = f"change by the edit{', over black' * self._asked.over_bright}"
        self._show(difference, what_if.image, "signed", meaning, f" brighter with {edit}")
        detail = f"{edit}: {effect_text(what_if)} ({answer.source})"
        self.pane.name_cover("What if", detail, self._caption)

    def _take_image(self, inputs: SceneInputs, image: Array) -> None:
        now = time.monotonic()
        recent = [kept for kept in self._images if now - kept[0] < KEPT_S]
        self._images = [*recent, (now, inputs, image[..., :3])]
        if self._asked.band is not None:
            self.refresh()

    def check_stop(self, state: EngineState | None = None) -> None:
        """Uncover a pane whose image is gone or belongs to another engine."""
        if self.pane.canvas.image is None or state is EngineState.LOADING:
            self._images.clear()
            self.show_what_if(None)

    def _uncover(self) -> None:
        was_shown, self._shown_as = self._shown_as, None
        self.bar.hide()
        # Leave other covers, such as a picture of the map.
        if was_shown is not None:
            self.pane.canvas.cover = None
            self.pane.name_cover("")
            self._changed()
        self.pane.canvas.update()

    def _show(
        self, field: Field, image: Array, measure: display.Shown, meaning: str, of_full: str
    ) -> None:
        """Cover an image by its field, with a colour bar, and say what full colour means."""
        ends = self.scale, max(float(np.abs(field).max()), self.scale)
        end, most = (f"{100 * e:.0f} %" if measure == "visible" else short(e) for e in ends)
        # A few pixels may be beyond the scale.
        less, more = ("≤ ", "≥ ") if most != end else ("", "")
        self._caption, self._shown_as = f"{more}{end}{of_full}", measure
        of_ground = partial(picture_on, self.pane.background)
        self.pane.canvas.cover = of_ground(display.overlay(image, field, self.scale, measure))
        texts = ("0", more + end, meaning)
        if measure == "signed":
            texts = (less + short(-self.scale), more + short(self.scale, signed=True), meaning)
        bar = of_ground(display.color_bar(measure, BAR.width())[None])
        self.bar.show_scale(bar, texts, self._caption)
        self._changed()

    def _cover(self, answer: Answer[Any], image: Array) -> None:
        is_part = isinstance(answer.request, ValueVisibilityRequest)
        measure: display.Shown = "visible" if is_part else self._asked.choices.measure
        keeps_scale = self._state.live or self._asked.dragging or self._asked.choices.locked
        if not keeps_scale or self._shown_as != measure:
            # One scale for exact and learned fields, or A and B: their colours can be compared.
            too = (self._asker.seen, self._asker.seen_too) if self._state.tf_input.compares else ()
            others = too if is_part else self._asker.both(self._asker.fields)
            values = answer.request.values
            every = (answer, *(a for a in others if a and a.request.values == values))
            least = LEAST_SEEN if is_part else display.FLOOR
            self.scale = max(
                display.scale_of(middle_square(self._shown(each)), least) for each in every
            )
        field, image = _square_together(self._shown(answer), image)
        asked = answer.request.values
        if is_part and asked[0] == asked[1]:
            asked = band_of_edit(asked, self._state.scalar_range, answer.request.width)
        values = self._state.range_text(asked)
        if is_part:
            of_full = f": part of a pixel that shows {values}"
            # It is the same by any engine.
            title, meaning, source = f"Where {values} is visible", "of the pixel", ""
        else:
            # The engine, or the light of which the field is instead of path-traced light.
            is_other = answer.source == "other light"
            source = "computed in soft light" if is_other else answer.source
            title, meaning = f"What an edit at {values} changes", f"change {RISES}, {source}"
            how = "brighter" if measure == "signed" else "changed"
            of_full = f" {how} {RISES}, {source}"
            if answer.source == "learned" and self._asker.hint:
                of_full += ", outside what it was trained on"
        band = self._asked.band
        if band is not None and band.kept:
            of_full += "; Escape returns to the image"
        self._show(_resized(field, image), image, measure, meaning, of_full)
        state = "refining" if answer.request.quality.live else ""
        self.pane.name_cover(title, ", ".join(filter(None, (source, state))), self._caption)

    def _shown(self, answer: Answer[Any]) -> Field:
        request = answer.request
        if isinstance(request, ValueVisibilityRequest):
            return np.asarray(answer.value, dtype=np.float64)
        edit = edit_over(request.values, self._state.scalar_range, request.width)
        return display.shown_field(answer.value, edit, self._asked.choices.measure)


def are_alike(one: tuple[int, ...], other: tuple[int, ...]) -> bool:
    """Return whether two images' shapes have the same proportions, or one is square."""
    (rows, columns), (height, width) = one[:2], other[:2]
    is_square = rows == columns or height == width
    return is_square or abs(rows * width - columns * height) <= max(*one[:2], *other[:2])


def _square_together(field: Field, image: Array) -> tuple[Field, Array]:
    """Crop the wider one to its middle square: the generator's image is square."""
    height, width = image.shape[:2]
    if height == width:
        return middle_square(field), image
    return field, middle_square(image) if field.shape[0] == field.shape[1] else image


def _resized(field: Field, image: Array) -> Field:
    if field.shape == image.shape[:2]:
        return field
    # Imported here: the window starts without them.
    from scipy.ndimage import uniform_filter
    from skimage.transform import resize

    # The mean over a pixel of a coarse field hides their grid: a quadratic spline.
    size = max(image.shape[0] // field.shape[0], 1)
    return np.asarray(uniform_filter(resize(field, image.shape[:2], order=1), size))
