"""Small pictures of the open volume for buttons and menus."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.client import EngineClient
from app.engines.messages import BatchRequest, Quality, Result
from app.image_view.image_canvas import to_qimage
from app.state.brightness import Brightness
from model.scene.inputs import SceneInputs

COARSENESS = 2.0
"""Factor of the sample distance in the pictures."""

PATIENCE_MS = 1000
"""Time after which the reference draws what the ray caster cannot draw yet.

On the first start the ray caster is compiled, for some 10 s; otherwise it is ready before.
"""


class SmallPictures(QObject):
    """Has pictures drawn; those asked for last are told.

    Parameters
    ----------
    kind : type of BatchRequest
        The newest request of a kind replaces one that waits.
    size : int
        Sides of the pictures, in pixels.
    analyst : EngineClient
        The ray caster, which draws them.
    reference : EngineClient
        Draws them while the ray caster is compiled.
    brightness : Brightness
        Of the pictures, too.
    """

    drawn = Signal(object)
    """Emitted with a list of QImage, in the order asked for."""

    def __init__(
        self,
        kind: type[BatchRequest],
        size: int,
        analyst: EngineClient,
        reference: EngineClient,
        brightness: Brightness,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._kind = kind
        self._quality = Quality(size, COARSENESS)
        self._analyst, self._reference = analyst, reference
        self._brightness = brightness
        self._asked = 0
        self._wanted: BatchRequest | None = None
        self._patience = QTimer(self, singleShot=True, interval=PATIENCE_MS)
        self._patience.timeout.connect(self._ask_reference)
        for client in (analyst, reference):
            client.resultReady.connect(self._take)
        analyst.resultReady.connect(self._call_off)

    def ask(self, wanted: Sequence[SceneInputs]) -> None:
        """Ask for the pictures of some inputs."""
        self._asked += 1
        first, *more = wanted
        self._wanted = self._kind(self._asked, first, self._quality, more=tuple(more))
        self._analyst.submit(self._wanted)
        self._patience.start()

    def _ask_reference(self) -> None:
        if self._wanted is not None and not self._analyst.is_ready:
            self._reference.submit(self._wanted)

    def _take(self, result: Result) -> None:
        request = result.request
        if not isinstance(request, self._kind) or result.value is None:
            return
        if request.sequence == self._asked:
            brightness = self._brightness.of("exact")
            self.drawn.emit([to_qimage(np.asarray(image), brightness) for image in result.value])

    def _call_off(self, result: Result) -> None:
        """Spare the reference what the ray caster has drawn by now."""
        if isinstance(result.request, self._kind) and result.request.sequence == self._asked:
            self._reference.abandon(self._kind)
