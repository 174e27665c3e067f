"""Pane of one engine's image: the canvas and, over it, a caption and the opacity image."""

import time

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QRect, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QImage, QPainter, QPen
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app import theme
from app.caption_button import CaptionButton, Tone
from app.controls import Painted, fill, wrapped
from app.engines.background import Pause
from app.engines.client import Channel, EngineClient, EngineName, EngineState
from app.engines.messages import Result
from app.engines.requests import Image, ReferenceSettings, Request
from app.image_view.image_canvas import LEAST_PROGRESS, ImageCanvas, to_qimage
from app.number_box import short
from app.picture import BLACK, Background
from app.state.edited_tf import PaneName
from app.state.edits import Brightness, Lit
from app.state.slow_answers import PATIENCE_MS
from model.scene.inputs import SceneInputs

PLACE = 8  # distance of the caption to the canvas's left and upper edge, in pixels
CALM_S = 0.25  # between two captions while something moves: a rate that flickers cannot be read
CUBE_ROOM = 76  # width next to the caption that is the orientation cube's, in pixels
OUTSIDE, HIGH = "outside training", "high for this model"

MOST_PROGRESS = 0.94  # of an image that is not complete yet


class EnginePane(QWidget):
    """Shows one engine's image. Its caption says how it was drawn; of a single image, its light.

    The images are those of a channel, by default the client's first.
    """

    imageShown = Signal(object, object)  # emitted with inputs and float32 image (H, W, 4)
    resultShown = Signal(object)  # with the Result of the image that is shown
    statusShown = Signal()  # whenever the caption has been written again

    title = Painted("", "_show_status")  # what the images are
    hint = Painted("", "_show_status")  # in which inputs the image is outside its model's training
    is_alone = Painted(False, "_show_status")  # as the only image: its caption is the light then
    background = Painted[Background](BLACK, "_show_brightness")

    def __init__(
        self,
        title: str,
        client: EngineClient,
        brightness: Brightness,
        engine: EngineName,
        channel: Channel | None = None,
    ) -> None:
        super().__init__()
        self.client, self.channel = client, channel or client.images
        self.name: PaneName = "B" if channel is client.images_b else "A"
        self.brightness = brightness
        self.engine: EngineName = engine
        self.lit: Lit = "b" if self.name == "B" else engine
        self._newest = -1
        self.rgba: NDArray[np.float32] | None = None
        self.detail = self._drawer = self.light = self._coming = self._remark = self._masked = ""
        self._most_samples = self.samples = 0
        self._is_unusual = False
        self.note = self._note_tip = self._tip = self._speed = ""
        self._cover = ("", "", "")
        self._said: object = None
        self._said_at = 0.0
        self._is_late = self._is_finer_next = False
        self.canvas = ImageCanvas(self)
        self.caption = CaptionButton(on_image=True)
        self.caption.setParent(self.canvas)
        # What the next and the present image depend on; B has its own settings.
        self._wanted: tuple[SceneInputs, ReferenceSettings | None] | None = None
        self._shown: tuple[SceneInputs, ReferenceSettings | None] | None = None
        self._of: SceneInputs | None = None  # inputs of the present image
        self._patience = Pause(self, PATIENCE_MS, self._be_late)
        fill(QVBoxLayout(self), self.canvas)
        for signal, slot in (
            (self.canvas.resized, self._show_status),
            (client.stateChanged, self._show_state),
            (self.channel.asked, self._wait),
            (self.channel.answered, self._show_result),
            (brightness.changed, self._show_brightness),
        ):
            signal.connect(slot)
        self.title = title
        self._show_state(client.state)

    def forget(self) -> None:
        """Free the image, because the pane is hidden."""
        self.rgba = self._shown = None
        self.canvas.show_image(None)

    def set_note(self, text: str, tip: str = "", is_unusual: bool = False) -> None:
        """Show the image's error, and whether it is far above those of test images."""
        self.note, self._note_tip, self._is_unusual = text, tip, is_unusual
        self._show_status()

    def set_light(self, light: str, coming: str = "", most_samples: int = 0) -> None:
        """Name the light of the image, and the one that follows once it can be drawn, if any."""
        if light != self.light:
            # They belong to an image in the previous light.
            self.samples = 0
        self.light, self._coming, self._most_samples = light, coming, most_samples
        self._show_status()

    def set_drawer(self, name: str, tip: str) -> None:
        """Set the name of the images' renderer, and the tooltip."""
        self._drawer, self._tip = name, tip
        self._show_status()

    def name_cover(self, title: str, detail: str = "", tip: str = "") -> None:
        """Make the caption name the picture that covers the image; empty for the image itself."""
        self._cover = (title, detail, tip) if title else ("", "", "")
        self._show_status()

    @property
    def shows_present(self) -> bool:
        """Whether there is an image that is up to date and not covered."""
        is_there = self.rgba is not None and not self.canvas.message
        return is_there and not self._is_late and not self._cover[0]

    @property
    def whole(self) -> NDArray[np.float32] | None:
        """The image if it shows the present inputs in all pixels, if not in all samples."""
        is_present = self._shown is not None and self._wanted in (None, self._shown)
        if self.rgba is None or self._speed or not is_present:
            return None
        is_full = self.rgba.shape[1::-1] == self.canvas.pixels
        return self.rgba if is_full or self.engine == "learned" else None

    def _show_state(self, state: EngineState) -> None:
        if state is EngineState.SETTLED and self.channel.is_pending:
            # The other image of the same engine has settled.
            state = EngineState.WORKING
        if state is EngineState.LOADING:
            # The light may have changed, so the shown image may be in another light.
            self._shown = None
        elif state is not EngineState.WORKING:
            self._wanted = None
            self._patience.stop()
            self._is_late = False
        has_image = self.canvas.image is not None and not self.canvas.message
        if state is EngineState.LOADING and not self.client.text and has_image:
            # Another engine for the same volume: the last image stays until there is a new one.
            return
        if state in (EngineState.WAITING, EngineState.LOADING, EngineState.PAUSED):
            self._newest = -1
            self.rgba = None
            self.detail = ""
            self._is_finer_next = False
            self.canvas.show_image(None)
            self.canvas.show_message(self.client.text or "Preparing …")
        elif state is EngineState.FAILED:
            self._is_finer_next = False
            self.canvas.show_message(self.client.text, theme.ON_IMAGE.error)
        elif state is EngineState.SETTLED:
            # Nothing follows.
            self._is_finer_next = False
            self._speed = ""
        self._show_status()

    def _show_result(self, result: Result) -> None:
        """Show an image unless a newer one is shown."""
        request = result.request
        if request.sequence < self._newest:
            return
        self._is_finer_next = not result.is_last
        self._newest = request.sequence
        if result.image is None:
            # The old image does not show the new request.
            self._wanted, self._is_late, self.note = None, False, ""
            self._patience.stop()
            self.forget()
            self.canvas.show_message(result.error or "", theme.ON_IMAGE.error)
            self._show_status()
            return
        if self._has_better(request, result.image):
            self._show_status()
            return
        rgba, by = result.image.rgba, result.image.by
        self.rgba, self._remark = rgba, result.remark
        self.canvas.show_image(self._picture(rgba))
        height, width, _ = rgba.shape
        # Models draw the whole volume, and a hint says so.
        parts = {"cropped": not request.inputs.part.is_whole, "masked": request.inputs.mask}
        shown = [name for name, part in parts.items() if part and self.engine == "exact"]
        facts = [*shown, by, f"{width} × {height} pixels", f"{short(result.seconds)} s"]
        self.detail = ", ".join(fact for fact in facts if fact)
        self._masked = "masked" * ("masked" in shown)
        if self.engine == "exact":
            # More is in the tooltip.
            self._drawer = by.partition(",")[0]
            self.samples = 0 if result.image.is_preview else result.image.samples
        moves = request.quality.live and result.seconds > 0
        self._speed = f"moving {short(min(1 / result.seconds, 999))} fps" if moves else ""
        self._of = request.inputs
        self._shown, self._is_late = (request.inputs, request.settings), False
        if self._wanted in (None, self._shown):
            self._patience.stop()
        else:
            self._patience.start()
        self.resultShown.emit(result)
        self._show_status()
        self.imageShown.emit(result.request.inputs, rgba)

    def _has_better(self, request: Request, image: Image) -> bool:
        """Whether more samples of the same scene are shown, from before its engine began anew."""
        is_same = self.rgba is not None and request.inputs == self._of
        return is_same and image.samples < self.samples and not image.is_last

    def _wait(self, request: Request) -> None:
        """Say that the image is late, unless the wanted one arrives soon."""
        self._wanted = request.inputs, request.settings
        if self._wanted != self._shown and not self._patience.isActive():
            self._patience.start()

    def _be_late(self) -> None:
        self._is_late = True
        self._show_status()

    def _show_status(self) -> None:
        """Show the image's error and progress in the caption."""
        self.canvas.progress = self._progress()
        if self._speed and not self.canvas.message and time.monotonic() < self._said_at + CALM_S:
            return
        title, text, tip = self._cover
        tone: Tone = "dim"
        lines = tip.splitlines()
        if not title:
            is_light = self.is_alone and self.light
            title = f"{self.light[:1].upper()}{self.light[1:]}" if is_light else self.title
            text, tone = self._status()
            note = self._note_tip if self.note else ""
            lines = [self._tip, self.hint, note, self.detail, self._remark]
        said = title, text, tone, tuple(lines), self.canvas.width()
        if said != self._said:
            self._said, self._said_at = said, time.monotonic()
            self.caption.title, self.caption.detail, self.caption.tone = title, text, tone
            self.canvas.setAccessibleName(self.caption.accessibleName())
            self.caption.setToolTip(wrapped(lines))
            self.place_caption(self.caption.parent())
        self.statusShown.emit()

    def place_caption(self, over: QObject | None) -> None:
        """Put the caption over a canvas; that of A has those of A and B next to its wipe line."""
        assert isinstance(over, ImageCanvas)
        if over is not self.caption.parent():
            self.caption.setParent(over)
            self.caption.show()
        left, right = 0, over.width() - CUBE_ROOM
        if over.wiped is not None:
            line = over.wiped[1]
            left, right = (0, line) if over is self.canvas else (line, right)
        width = min(self.caption.sizeHint().width(), right - left - 2 * PLACE)
        self.caption.setFixedWidth(max(width, 0))
        self.caption.move(left + PLACE, PLACE)

    def _status(self) -> tuple[str, Tone]:
        state = self.client.state
        is_refused = self.rgba is None and self._newest >= 0 and self.canvas.message
        if state is EngineState.FAILED or is_refused:
            return "failed", "error"
        if self.rgba is None:
            return self.note, "dim"
        if self._is_late:
            return "drawing …", "change"
        coming = f"{self._coming} follows" if self._coming else ""
        if self.is_alone and self.light:
            return ", ".join(filter(None, (coming, self._masked))), "dim"
        if self._speed:
            return self._speed, "dim"
        facts = [self._drawn_text(), self._masked, coming, self.note]
        tone: Tone = "dim"
        if self.hint or self._is_unusual:
            facts.append(OUTSIDE if self.hint else HIGH)
            tone = "attention"
        return ", ".join(fact for fact in facts if fact), tone

    def light_text(self, samples: int) -> str:
        """Light of a picture, with the samples of each pixel if it is path-traced."""
        if not self._most_samples:
            return self.light
        return f"{self.light}, {samples} sample{'s' * (samples > 1)} of each pixel"

    def _drawn_text(self) -> str:
        """Light, unless the title says it, and progress: "path traced, 8 of 32 samples"."""
        count, most = self.samples, self._most_samples
        if not most:
            return self._drawer
        how = "" if self.title.endswith(self.light) else "path traced"
        of = f" of {most}" if self._is_finer_next and count < most else ""
        many = f"{count}{of} sample{'s' * (count > 1 or bool(of))}" * bool(count)
        return ", ".join(filter(None, (how, many)))

    def _progress(self) -> float | None:
        """Share of the pixels that are drawn; None for a complete image."""
        if self._is_late:
            return LEAST_PROGRESS
        if self.rgba is None or not self._is_finer_next or self._speed:
            return None
        shown, whole = self.rgba.shape[1], max(self.canvas.pixels[0], 1)
        return min(max(shown / whole, LEAST_PROGRESS), MOST_PROGRESS)

    def _show_brightness(self) -> None:
        self.canvas.background = self.background
        if self.rgba is not None:
            self.canvas.replace_image(self._picture(self.rgba))

    def _picture(self, rgba: NDArray[np.float32]) -> QImage:
        return to_qimage(rgba, self.brightness.of(self.lit), clear=self.background != BLACK)


SHARE, MARGIN = 0.3, 12  # the inset's edge by the image's; pixels to the image's edges

SCALE_BAR = 1 / 12, 36
"""Height that a scale bar has below the inset: as a fraction of the image's shorter side, and at
least in pixels."""


class OpacityInset(QObject):
    """Paints how opaque each pixel is, white for opaque, unless something covers the image."""

    is_shown = Painted(False, "_refresh")  # where there is an image

    def __init__(self, pane: EnginePane) -> None:
        super().__init__(pane)
        self._pane = pane
        self.picture: QImage | None = None  # the painted image; None while it is not shown
        pane.imageShown.connect(lambda *_: self._refresh())
        pane.canvas.decorations.append(self._paint)

    @property
    def box(self) -> QRectF:
        """Rectangle of the image in the canvas; empty without an image."""
        if self.picture is None:
            return QRectF()
        whole = self._pane.canvas.picture_rect & self._pane.canvas.rect()
        width = SHARE * whole.width()
        height = width * self.picture.height() / self.picture.width()
        share, least = SCALE_BAR
        bottom = whole.bottom() - max(share * min(whole.width(), whole.height()), least)
        return QRectF(whole.left() + MARGIN, bottom - height, width, height)

    def _refresh(self) -> None:
        rgba = self._pane.rgba if self.is_shown else None
        self.picture = None if rgba is None else to_qimage(np.repeat(rgba[..., 3:], 4, axis=2))
        self._pane.canvas.update()

    def _paint(self, painter: QPainter, _square: QRect) -> None:
        canvas = self._pane.canvas
        if self.picture is None or canvas.cover is not None:
            return
        box = self.box
        painter.drawImage(box, self.picture)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(theme.ON_IMAGE.line), 1))
        painter.drawRect(box)
        painter.setPen(QColor(theme.ON_IMAGE.dim))
        where = box.adjusted(6, 4, -4, -4)
        painter.drawText(where, Qt.AlignmentFlag.AlignTop, "Opacity image")
