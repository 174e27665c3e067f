"""Pictures of the open volume under each preset."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QObject
from PySide6.QtGui import QImage

from app.tf_editor.preset_menu import PICTURE, PresetMenu
from app.window.context import Context
from app.window.small_pictures import SmallPictures
from model.scene.tf_presets import Preset


class PresetPictures(QObject):
    """Has pictures drawn whenever the menu of presets opens, from the present side."""

    def __init__(self, menu: PresetMenu, context: Context) -> None:
        super().__init__(menu)
        self._menu, self._state = menu, context.state
        self._names: tuple[str, ...] = ()
        self._pictures = SmallPictures("presets", PICTURE, context, self._show)
        menu.picturesWanted.connect(self._ask)
        menu.aboutToHide.connect(self._pictures.stop_tracing)

    def _ask(self, listed: tuple[Preset, ...]) -> None:
        self._names = tuple(preset.name for preset in listed)
        # The image may be wider than the pictures, and zoomed.
        shown = replace(self._state.inputs, view=self._state.for_picture(self._state.view))
        self._pictures.ask(
            [
                replace(shown, opacity_tf=preset.tf.opacity, color_tf=preset.tf.color)
                for preset in listed
            ]
        )

    def _show(self, images: list[QImage]) -> None:
        self._menu.set_pictures(dict(zip(self._names, images, strict=True)))
