"""Small pictures of the open volume, drawn by the ray caster for buttons and menus."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QObject, Signal

from app.engines.client import EngineClient
from app.engines.messages import BatchRequest, Quality, Result
from app.image_view.image_canvas import to_qimage
from model.scene.inputs import SceneInputs

COARSENESS = 2.0
"""Factor of the sample distance in the pictures."""


class SmallPictures(QObject):
    """Has pictures drawn; those asked for last are told.

    Parameters
    ----------
    kind : type of BatchRequest
        The newest request of a kind replaces one that waits.
    size : int
        Sides of the pictures, in pixels.
    analyst : EngineClient
        The ray caster.
    """

    drawn = Signal(object)
    """Emitted with a list of QImage, in the order asked for."""

    def __init__(
        self, kind: type[BatchRequest], size: int, analyst: EngineClient, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._kind = kind
        self._quality = Quality(size, COARSENESS)
        self._analyst = analyst
        self._asked = 0
        analyst.resultReady.connect(self._take)

    def ask(self, wanted: Sequence[SceneInputs]) -> None:
        """Ask for the pictures of some inputs."""
        self._asked += 1
        first, *more = wanted
        self._analyst.submit(self._kind(self._asked, first, self._quality, more=tuple(more)))

    def _take(self, result: Result) -> None:
        request = result.request
        if not isinstance(request, self._kind) or result.value is None:
            return
        if request.sequence == self._asked:
            self.drawn.emit([to_qimage(np.asarray(image)) for image in result.value])
