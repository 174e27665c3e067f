"""Pictures of the open volume under each preset, drawn by the ray caster."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from PySide6.QtCore import QObject

from app.engines.client import EngineClient
from app.engines.messages import PresetRequest, Quality, Result
from app.image_view.image_canvas import to_qimage
from app.state.viewer_state import ViewerState
from app.tf_editor.preset_menu import PICTURE, PresetMenu
from model.scene.tf_presets import Preset

COARSENESS = 2.0
"""Factor of the sample distance in the pictures."""


class PresetPictures(QObject):
    """Has pictures drawn whenever the menu of presets opens, in the present view and light.

    Parameters
    ----------
    menu : PresetMenu
    state : ViewerState
    analyst : EngineClient
        The ray caster.
    """

    def __init__(self, menu: PresetMenu, state: ViewerState, analyst: EngineClient) -> None:
        super().__init__(menu)
        self._menu = menu
        self._state = state
        self._analyst = analyst
        self._asked = 0
        self._names: tuple[str, ...] = ()
        menu.picturesWanted.connect(self._ask)
        analyst.resultReady.connect(self._take)

    def _ask(self, listed: tuple[Preset, ...]) -> None:
        self._asked += 1
        self._names = tuple(preset.name for preset in listed)
        shown = self._state.inputs
        first, *more = (
            replace(shown, opacity_tf=preset.tf.opacity, color_tf=preset.tf.color)
            for preset in listed
        )
        quality = Quality(PICTURE, COARSENESS)
        self._analyst.submit(PresetRequest(self._asked, first, quality, more=tuple(more)))

    def _take(self, result: Result) -> None:
        request = result.request
        if not isinstance(request, PresetRequest) or result.value is None:
            return
        if request.sequence == self._asked:
            images = [to_qimage(np.asarray(each)) for each in result.value]
            self._menu.set_pictures(dict(zip(self._names, images, strict=True)))
