"""Pictures of the open volume under each preset."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QObject
from PySide6.QtGui import QImage

from app.engines.client import EngineClient
from app.state.brightness import Brightness
from app.state.reference_work import ReferenceWork
from app.state.viewer_state import ViewerState
from app.tf_editor.preset_menu import PICTURE, PresetMenu
from app.window.small_pictures import SmallPictures
from model.scene.tf_presets import Preset


class PresetPictures(QObject):
    """Has pictures drawn whenever the menu of presets opens, from the present side.

    Parameters
    ----------
    analyst, reference : EngineClient
        Draw the pictures; see :class:`~app.window.small_pictures.SmallPictures`.
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
        self._work = work
        self._names: tuple[str, ...] = ()
        self._pictures = SmallPictures("presets", PICTURE, analyst, reference, brightness, self)
        self._pictures.drawn.connect(self._show)
        menu.picturesWanted.connect(self._ask)
        menu.aboutToHide.connect(self._pictures.trace_no_more)

    def _ask(self, listed: tuple[Preset, ...]) -> None:
        self._names = tuple(preset.name for preset in listed)
        # The image may be wider than the pictures, and zoomed.
        shown = replace(self._state.inputs, view=self._state.for_picture(self._state.view))
        self._pictures.ask(
            [
                replace(shown, opacity_tf=preset.tf.opacity, color_tf=preset.tf.color)
                for preset in listed
            ],
            traced=self._work.settings.lighting == "path",
        )

    def _show(self, images: list[QImage]) -> None:
        self._menu.set_pictures(dict(zip(self._names, images, strict=True)))
