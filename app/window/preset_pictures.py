"""Pictures of the open volume under each preset."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject
from PySide6.QtGui import QImage

from app.engines.client import EngineClient
from app.state.brightness import Brightness
from app.state.reference_work import ReferenceWork
from app.state.viewer_state import ViewerState
from app.tf_editor.preset_menu import PICTURE, PresetMenu
from app.window.small_pictures import SmallPictures
from model.scene.tf_presets import Preset

NEARLY_BLACK = 0.02
"""Root mean square of a picture's brightness below which a preset is folded: half a thousandth of
the pixels are white, say."""


class PresetPictures(QObject):
    """Has pictures drawn whenever the menu of presets opens, from the present side.

    Of another volume, or over another range, they are drawn once before, as the order of the
    presets is by what they show: those with the strongest contrast first, nearly black ones last
    and folded.

    Parameters
    ----------
    menu : PresetMenu
    state : ViewerState
    analyst, reference : EngineClient
        Draw the pictures; see :class:`~app.window.small_pictures.SmallPictures`.
    brightness : Brightness
    work : ReferenceWork
        Knows the light.
    """

    def __init__(
        self,
        menu: PresetMenu,
        state: ViewerState,
        analyst: EngineClient,
        reference: EngineClient,
        brightness: Brightness,
        work: ReferenceWork,
    ) -> None:
        super().__init__(menu)
        self._menu = menu
        self._state = state
        self._reference, self._work = reference, work
        self._names: tuple[str, ...] = ()
        self._pictures = SmallPictures("presets", PICTURE, analyst, reference, brightness, self)
        self._pictures.drawn.connect(self._show)
        menu.picturesWanted.connect(self._follow)
        menu.aboutToHide.connect(self._pictures.trace_no_more)
        self._ranked: object = None
        reference.settled.connect(self._rank_new)

    def _rank_new(self) -> None:
        of = self._menu.histogram_counts
        if of is not self._ranked and not self._reference.error and len(of) > 1:
            self._ranked = of
            self._ask(self._menu.listed())

    def _follow(self, listed: tuple[Preset, ...]) -> None:
        self._ask(listed, traced=self._work.settings.lighting == "path")

    def _ask(self, listed: tuple[Preset, ...], traced: bool = False) -> None:
        self._names = tuple(preset.name for preset in listed)
        # The image may be wider than the pictures, and zoomed.
        shown = replace(self._state.inputs, view=self._state.for_picture(self._state.view))
        self._pictures.ask(
            [
                replace(shown, opacity_tf=preset.tf.opacity, color_tf=preset.tf.color)
                for preset in listed
            ],
            traced,
        )

    def _show(self, images: list[QImage]) -> None:
        pictures = dict(zip(self._names, images, strict=True))
        self._menu.set_pictures(pictures)
        self._menu.rank(
            {name: contrast(picture) for name, picture in pictures.items()},
            frozenset(name for name, picture in pictures.items() if is_nearly_black(picture)),
        )


def contrast(picture: QImage) -> float:
    """Standard deviation of a picture's brightness, 0 to 0.5; 0 for a black one."""
    return float(_levels(picture).std())


def is_nearly_black(picture: QImage) -> bool:
    """Whether next to nothing is seen in a picture: few pixels that are bright, or none."""
    return float(np.sqrt(np.mean(_levels(picture) ** 2))) < NEARLY_BLACK


def _levels(picture: QImage) -> NDArray[np.float64]:
    """Brightness of a picture's pixels, 0 to 1."""
    gray = picture.convertToFormat(QImage.Format.Format_Grayscale8)
    rows = np.frombuffer(gray.constBits(), np.uint8).reshape(gray.height(), gray.bytesPerLine())
    return rows[:, : gray.width()] / 255
